"""Conceals cases in worker processes: recordings for the diagnosis, seals for the end, hashes for the public.

A case with streams has a fault of motion, stamps or second encoders, in a recording as a session leaves it. A case on
wires goes the whole way: emulated PSD box, CAN encoders and controller, recorded as on site. The emulators get what is
hidden over their standard input, never through a file; the recording holds the assumed rig and nothing of the world.
"""

import json
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from acquisition.recording import Channel, Event, Recording, RecordingWriter, read
from acquisition.recording.rig import parse_rig, plain_rig, rig_text
from acquisition.session.plan import PlanOptions
from calibeam.console import Console
from calibeam.devices.recorder import new_recording, record_session
from calibeam.devices.site import addresses_of, connected
from calibeam.emulation import EmulationError
from calibeam.outcome import PartialResult
from calibeam.printing.progress import progress_bar
from calibeam.prove.motion_recording import record_motion, record_wired_motion
from calibeam.prove.record import PLAIN
from calibeam.prove.scenario import DRAWS, WIRED_DRAWS, Mix, Scenario, scenario, wired_scenario
from calibeam.prove.seal import Layout, fingerprint, new_key, seal_truth
from calibeam.prove.unseen import write_asked
from calibeam.rig_files import RIGS
from calibeam.software import SOFTWARE
from calibeam.worker_processes import in_workers
from calibrate.diagnose.streams import sample_windows
from drivers.clock import SystemClock
from drivers.errors import DeviceError
from simulators.conceal.case import Case, conceal
from simulators.conceal.case_files import columns, csv_text, pair_of, truth_document
from simulators.conceal.on_wire import Taken, Wired, draw_wired, taken_case
from simulators.conceal.rig_file import rig_document, toml_text
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import written
from simulators.process import Emulators
from simulators.streams.faults import FAULTS, StreamFault
from simulators.streams.stream_session import HOST_S, StreamedSession, streamed

HEALTHY = 0.25  # share of the cases with streams in which nothing is wrong
UNITS = {"target_q_rad": "rad", "actual_q_rad": "rad", "position_rad": "rad", "photocurrent_a": "A"}


class _HostTime:
    """Of a session that is written long after it was drawn."""

    def now_s(self) -> float:
        return HOST_S


def conceal_streams(case: Case, mechanism: str | None, path: Path) -> tuple[StreamFault, ...]:
    """Draws a fault, or none, and writes the recording; returns what is wrong with it."""
    rng = np.random.default_rng([case.wanted.seed, 21])
    among = [kind for kind in FAULTS if mechanism in (None, kind.KIND)]
    kind = among[int(rng.integers(len(among)))]
    wrong = rng.random() >= HEALTHY or mechanism is not None
    fault = kind.draw(rng, case.posture_rad.shape[1]) if wrong else None
    session = streamed(case, fault, rng)
    _write(case, session, path)
    return () if fault is None else (fault,)


def fault_records(faults: tuple[StreamFault, ...]) -> list[dict[str, Any]]:
    """For the truth, in the words that a mechanism of the chain has there."""
    return [
        {
            "mechanism": fault.KIND,
            "physics": fault.PHYSICS,
            "port": fault.port,
            "drivers": list(fault.drivers),
            "fields": dict(vars(fault)),
            "figures": dict(fault.figures),
            "enr": fault.size,
        }
        for fault in faults
    ]


def _write(case: Case, session: StreamedSession, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    text = toml_text(rig_document(case.stated))
    with RecordingWriter(path, rig_text=text, software=SOFTWARE, clock=_HostTime(), host_s0=HOST_S) as writer:
        for row in _rows(case, session):
            writer.sample(row, HOST_S + float(row["t_s"]))
        for (from_s, to_s), at_s in zip(session.window_s.tolist(), session.read_s.tolist(), strict=True):
            writer.event(Event(HOST_S + at_s, "sample", {"psd_from_s": from_s, "psd_to_s": to_s}))
        for name, stream in session.streams.items():
            channels = tuple(Channel(c, UNITS[c], values.shape[1:]) for c, values in stream.values.items())
            writer.stream(name, channels, stamps="sampled").append(
                stream.host_s, stream.device_s, stream.sequence, stream.values
            )


def _rows(case: Case, session: StreamedSession) -> list[Mapping[str, Any]]:
    """The samples of the case, at the times at which the streams have them."""
    table = columns(case) | {"t_s": session.read_s.tolist()}
    return [dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True)]


RIG = RIGS / "ur5e-dual-psd.toml"
PACE = 8.0  # emulated seconds in one of ours, as in `calibeam demo`
CENTRED, REPEATS = 2, 2  # a place and order
ORDERS = 2


def conceal_on_wires(wanted: Wanted, path: Path, pace: float = PACE) -> Case:
    """Runs the session; the recording is at `path`. ConcealError where it could not be had."""
    wired = draw_wired(wanted, plain_rig(rig_text(RIG), str(RIG)))
    try:
        _record(wired, path, pace)
    except (PartialResult, DeviceError, EmulationError) as reason:
        raise ConcealError(f"the session on the wires ended early: {reason}") from reason
    return taken_case(wired, _taken(read(path)))


def _record(wired: Wired, path: Path, pace: float) -> None:
    text, clock = toml_text(wired.site_rig), SystemClock()
    rig = parse_rig(text, "rig of the site")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)  # of an attempt that ended early
    block = wired.wanted.samples // (ORDERS * wired.wanted.places)
    each = max(block - 2 * REPEATS - CENTRED, REPEATS)
    options = PlanOptions(centred=CENTRED, off_centre=each, repeats=REPEATS, seed=wired.wanted.seed)
    hidden = written([one.defect for one in wired.hidden])
    with (
        Emulators(wired.emulated, seed=wired.wanted.seed, time_scale=pace, links=False, hidden=hidden) as emulators,
        new_recording(path, text, clock, {}) as writer,
    ):

        def place(placement: int) -> None:
            emulators.ask("fixture.place", id=placement)

        addresses = addresses_of(rig, emulators.address, pace)
        with connected(rig, addresses, writer, clock, place) as bench:
            record_session(bench, rig, writer, options, clock, progress_bar(Console(quiet=True)))


def _taken(recording: Recording) -> Taken:
    """ConcealError where the recording has no times of its samples."""
    samples, windows = recording.samples, sample_windows(recording)
    if windows is None:
        raise ConcealError("the session on the wires took no sample, or recorded no times")
    t_s = samples.column("t_s")
    n = range(1, samples.n_joints + 1)
    return Taken(
        t_s=t_s,
        power_on_s=float(np.median([0.5 * (w.from_s + w.to_s) for w in windows] - t_s)),
        reading_rad=samples.joints(),
        approach=np.stack([samples.column(f"approach{i}") for i in n], axis=1),
        placement=samples.integers("placement", 0),
        first_psd=samples.integers("first_psd", 0),
        repeat=samples.integers("repeat", 0),
        spots_m=np.stack([samples.column(f"psd{k}_{axis}_m") for k in (1, 2) for axis in "xy"], axis=1),
    )


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


def conceal_cases(
    layout: Layout, mix: Mix, seed: int, cases: int, jobs: int, numbers: Sequence[int]
) -> Generator[Concealed]:
    """These of the cases; from number `cases` on they are recorded over wires.

    Those come first, one at a time, for emulators and readers take two cores; then all others in their order.

    ConcealError where one cannot be drawn at all, or a machine is too busy for a session on the wires.
    """
    orders = [_Order(layout, mix, seed, number, new_key(), number >= cases) for number in numbers]
    for few, at_a_time in (([o for o in orders if o.wired], 1), ([o for o in orders if not o.wired], jobs)):
        if few:
            yield from in_workers(_conceal, few, at_a_time)


def publish(layout: Layout, cases: Sequence[Concealed], before: str = "") -> str:
    """Writes all hashes to a file, after those from `before`; returns the hash of that file, which stands for all."""
    text = before + "".join(f"{one.sha256}  {one.scenario.name}\n" for one in cases)
    layout.hashes.write_text(text, encoding="utf-8")
    return fingerprint(text.encode())


def _conceal(order: _Order) -> Concealed:
    first = (wired_scenario if order.wired else scenario)(order.mix, order.seed, order.number, 0)
    if first.kind == "motion":
        return _conceal_motion(order)
    drawn, case, simulated, attempts = _drawn(order)
    truth = truth_document(case)
    if drawn.wanted.beside == "constants":
        truth["defects"] += [one for one in truth["constants"] if one["enr"] >= PLAIN]
    recorded = order.layout.recorded(drawn.name)
    if drawn.kind == "streams":
        truth["defects"] = fault_records(conceal_streams(case, order.mix.mechanism, recorded))
    elif not order.wired:
        write_recording(case, order.layout.recording(drawn.name))
    if simulated is not None:
        write_recording(simulated, order.layout.simulation(drawn.name))
    text = json.dumps(truth).encode()
    write_asked(truth["free_space"], order.layout.asked(drawn.name))
    return _sealed(order, drawn, text, attempts)


def _conceal_motion(order: _Order) -> Concealed:
    """An arm in motion; over wires, where a busy machine may end a recording early, some attempts."""
    last: ConcealError | None = None
    for attempt in range(WIRED_DRAWS if order.wired else 1):
        drawn = (wired_scenario if order.wired else scenario)(order.mix, order.seed, order.number, attempt)
        path = order.layout.recorded(drawn.name)
        try:
            truth = record_wired_motion(drawn.wanted, path) if order.wired else record_motion(drawn.wanted, path)
        except ConcealError as reason:
            last = reason
            continue
        return _sealed(order, drawn, json.dumps(truth).encode(), attempt)
    raise ConcealError(f"case {order.number}: no draw gave a motion; the last one: {last}")


def _sealed(order: _Order, drawn: Scenario, truth: bytes, attempts: int) -> Concealed:
    seal = order.layout.seal(drawn.name)
    seal.parent.mkdir(parents=True, exist_ok=True)
    seal.write_bytes(seal_truth(truth, order.key))
    return Concealed(drawn, fingerprint(truth), order.key, attempts)


def _drawn(order: _Order) -> tuple[Scenario, Case, Case | None, int]:
    """With the simulation, if one stands beside it, and the number of attempts that gave no session."""
    last: ConcealError | None = None
    for attempt in range(WIRED_DRAWS if order.wired else DRAWS):
        try:
            if order.wired:
                # what a session over wires needs, devices' libraries and all, is a second of each process that has none

                drawn = wired_scenario(order.mix, order.seed, order.number, attempt)
                return drawn, conceal_on_wires(drawn.wanted, order.layout.recorded(drawn.name)), None, attempt
            drawn = scenario(order.mix, order.seed, order.number, attempt)
            case = conceal(drawn.wanted)
            measured, simulated = (case, None) if drawn.wanted.beside is None else pair_of(case)
            return drawn, measured, simulated, attempt
        except ConcealError as reason:
            last = reason
    raise ConcealError(f"case {order.number}: no draw gave a session; the last one: {last}")


def write_recording(case: Case, folder: Path) -> None:
    """The recording alone: nothing else of a case is ever written in clear before all are diagnosed."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_text(toml_text(rig_document(case.stated)), encoding="utf-8")
    (folder / "samples.csv").write_text(csv_text(columns(case)), encoding="utf-8", newline="")
