"""Conceals cases in worker processes: recordings for the diagnosis, seals for the end, hashes for the public."""

import json
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path

from calibeam.prove.layout import Layout
from calibeam.prove.scenario import DRAWS, WIRED_DRAWS, Mix, Scenario, scenario, wired_scenario
from calibeam.prove.seal import fingerprint, new_key, sealed
from calibeam.prove.streamed import conceal_streams, told
from calibeam.prove.unseen import write_asked
from calibeam.worker_processes import in_workers
from simulators.conceal.belief import rig_document
from simulators.conceal.case import Case, conceal
from simulators.conceal.reveal import truth_document
from simulators.conceal.toml_text import toml_text
from simulators.conceal.wanted import ConcealError
from simulators.conceal.write import columns, csv_text


@dataclass(frozen=True)
class Concealed:
    """One case that waits for its diagnosis. The key stays in this process."""

    scenario: Scenario
    sha256: str
    key: bytes
    attempts: int  # that gave no session, before this one


@dataclass(frozen=True)
class _Order:
    layout: Layout
    mix: Mix
    seed: int
    number: int
    key: bytes
    wired: bool = False


def conceal_cases(layout: Layout, mix: Mix, seed: int, cases: int, jobs: int, wired: int = 0) -> Generator[Concealed]:
    """The wired cases first, one at a time, for emulators and readers take two cores; then all others in their order.

    ConcealError where one cannot be drawn at all, or a machine is too busy for a session on the wires.
    """
    orders = [_Order(layout, mix, seed, number, new_key(), number >= cases) for number in range(cases + wired)]
    for few, at_a_time in ((orders[cases:], 1), (orders[:cases], jobs)):
        if few:
            yield from in_workers(_conceal, few, at_a_time)


def publish(layout: Layout, cases: list[Concealed]) -> str:
    """Writes all hashes to a file; returns the hash of that file, which stands for them all."""
    text = "".join(f"{one.sha256}  {one.scenario.name}\n" for one in cases)
    layout.hashes.write_text(text, encoding="utf-8")
    return fingerprint(text.encode())


def _conceal(order: _Order) -> Concealed:
    drawn, case, attempts = _drawn(order)
    truth = truth_document(case)
    recorded = order.layout.recorded(drawn.name)
    if drawn.kind == "streams":
        truth["defects"] = told(conceal_streams(case, order.mix.mechanism, recorded))
    elif not order.wired:
        _write_recording(case, order.layout.recording(drawn.name))
    text = json.dumps(truth).encode()
    write_asked(truth["free_space"], order.layout.asked(drawn.name))
    seal = order.layout.seal(drawn.name)
    seal.parent.mkdir(parents=True, exist_ok=True)
    seal.write_bytes(sealed(text, order.key))
    return Concealed(drawn, fingerprint(text), order.key, attempts)


def _drawn(order: _Order) -> tuple[Scenario, Case, int]:
    last: ConcealError | None = None
    for attempt in range(WIRED_DRAWS if order.wired else DRAWS):
        try:
            if order.wired:
                # what a session over wires needs, devices' libraries and all, is a second of each process that has none
                from calibeam.prove.wired import conceal_on_wires

                drawn = wired_scenario(order.seed, order.number, attempt)
                return drawn, conceal_on_wires(drawn.wanted, order.layout.recorded(drawn.name)), attempt
            drawn = scenario(order.mix, order.seed, order.number, attempt)
            return drawn, conceal(drawn.wanted), attempt
        except ConcealError as reason:
            last = reason
    raise ConcealError(f"case {order.number}: no draw gave a session; the last one: {last}")


def _write_recording(case: Case, folder: Path) -> None:
    """The recording alone: nothing else of a case is ever written in clear before all are diagnosed."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(toml_text(rig_document(case.belief)), encoding="utf-8")
    (folder / "samples.csv").write_text(csv_text(columns(case)), encoding="utf-8", newline="")
