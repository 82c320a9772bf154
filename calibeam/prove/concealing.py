"""Conceals cases in worker processes: recordings for the diagnosis, seals for the end, hashes for the public."""

import json
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from calibeam.prove.layout import Layout
from calibeam.prove.scenario import DRAWS, Mix, Scenario, scenario
from calibeam.prove.seal import fingerprint, new_key, sealed
from simulators.conceal.belief import rig_document
from simulators.conceal.case import Case, conceal
from simulators.conceal.reveal import truth_document
from simulators.conceal.table import csv_text
from simulators.conceal.toml_text import toml_text
from simulators.conceal.wanted import ConcealError
from simulators.conceal.write import columns


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


def conceal_cases(layout: Layout, mix: Mix, seed: int, cases: int, jobs: int) -> Iterator[Concealed]:
    """Cases in their order. ConcealError where one cannot be drawn at all."""
    orders = [_Order(layout, mix, seed, number, new_key()) for number in range(cases)]
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield from pool.map(_conceal, orders)


def publish(layout: Layout, cases: list[Concealed]) -> str:
    """Writes all hashes to a file; returns the hash of that file, which stands for them all."""
    text = "".join(f"{one.sha256}  {one.scenario.name}\n" for one in cases)
    layout.hashes.write_text(text, encoding="utf-8")
    return fingerprint(text.encode())


def _conceal(order: _Order) -> Concealed:
    drawn, case, attempts = _drawn(order)
    truth = truth_document(case)
    text = json.dumps(truth).encode()
    _write_recording(case, order.layout.recording(drawn.name))
    _write_asked(truth["free_space"], order.layout.asked(drawn.name))
    seal = order.layout.seal(drawn.name)
    seal.parent.mkdir(parents=True, exist_ok=True)
    seal.write_bytes(sealed(text, order.key))
    return Concealed(drawn, fingerprint(text), order.key, attempts)


def _drawn(order: _Order) -> tuple[Scenario, Case, int]:
    last: ConcealError | None = None
    for attempt in range(DRAWS):
        drawn = scenario(order.mix, order.seed, order.number, attempt)
        try:
            return drawn, conceal(drawn.wanted), attempt
        except ConcealError as reason:
            last = reason
    raise ConcealError(f"case {order.number}: {DRAWS} draws gave no session; the last one: {last}")


def _write_recording(case: Case, folder: Path) -> None:
    """The recording alone: nothing else of a case is ever written in clear before all are diagnosed."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(toml_text(rig_document(case.belief)), encoding="utf-8")
    (folder / "samples.csv").write_text(csv_text(columns(case)), encoding="utf-8", newline="")


def _write_asked(free_space: dict[str, Any], path: Path) -> None:
    """Joint readings and the side from which each joint came: standing, unloaded, as warm as at the first sample."""
    readings, approach = free_space["reading_rad"], free_space["approach"]
    joints = range(1, len(readings[0]) + 1)
    lines = [",".join([*(f"q{j}_rad" for j in joints), *(f"approach{j}" for j in joints)])]
    lines += [",".join(map(repr, [*q, *a])) for q, a in zip(readings, approach, strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
