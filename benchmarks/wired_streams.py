"""Faults of streams over real wires: emulated devices in trouble, a session recorded by our own recorder, diagnosed."""

import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import msgspec
from rich.console import Console

from acquisition.recording import Recording, RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from benchmarks.disturbed import Trouble
from calibeam.devices.recorder import record_session
from calibeam.devices.site import addresses_of, connected
from calibeam.printing.progress import progress_bar
from calibeam.results.diagnosis import diagnose_recording
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.report.diagnosis.words import stream_words
from drivers.clock import SystemClock
from simulators.process import EmulatorProcess

SHORT = PlanOptions(centred=1, off_centre=6, repeats=1)
Inject = Callable[[EmulatorProcess], None]


@dataclass(frozen=True)
class Troubled:
    """One session: what is wrong from the start, and what happens after so many samples."""

    trouble: Trouble = field(default_factory=Trouble)
    at_start: Inject | None = None
    later: tuple[tuple[int, Inject], ...] = field(default_factory=tuple)
    options: PlanOptions = SHORT
    places: int = 1
    time_scale: float = 1.0  # CAN frames carry the host's stamps: to be judged in time they want an even pace


def recorded(rig_file: Path, case: Troubled, path: Path, seed: int = 1) -> Recording:
    """RecordingError, DeviceError as a session on site."""
    rig, clock = load_rig(rig_file), SystemClock()
    rig = msgspec.structs.replace(rig, placement_list=rig.placement_list[: case.places])
    command = [sys.executable, "-m", "benchmarks.disturbed", str(rig_file), json.dumps(asdict(case.trouble))]
    command += [str(seed), str(case.time_scale)]
    with EmulatorProcess(command) as emulators:
        if case.at_start is not None:
            case.at_start(emulators)
        with (
            RecordingWriter(path, rig_text=rig_text(rig_file), software="benchmark", clock=clock) as writer,
            connected(
                rig,
                addresses_of(rig, emulators.address, case.time_scale),
                writer,
                clock,
                lambda place: emulators.ask("fixture.place", id=place),
            ) as bench,
        ):
            _arrange(writer, emulators, case.later)
            record_session(bench, rig, writer, case.options, clock, progress_bar(Console(quiet=True)))
    return read(path)


def _arrange(writer: RecordingWriter, emulators: EmulatorProcess, later: tuple[tuple[int, Inject], ...]) -> None:
    """Trouble comes when so many samples have been taken."""
    plain, taken = writer.sample, [0]

    def counted(*sample: object) -> None:
        plain(*sample)
        taken[0] += 1
        for count, inject in later:
            if count == taken[0]:
                inject(emulators)

    writer.sample = counted


def diagnosed(rig_file: Path, case: Troubled, seed: int = 1) -> tuple[Recording, DiagnosisFile]:
    """A session in trouble, and what `calibeam diagnose` says of it."""
    with tempfile.TemporaryDirectory() as folder:
        recording = recorded(rig_file, case, Path(folder) / "recording.mcap", seed)
        return recording, diagnose_recording(recording)[1]


def psd_clock(**settings: float) -> Inject:
    """The PSD box's clock is set, or runs at another rate."""
    return lambda emulators: emulators.inject("psd", "clock", **settings)


def line(device: str, kind: str, count: int, **settings: float) -> Inject:
    """The next outputs of a device are struck."""
    return lambda emulators: emulators.inject(device, kind, count=count, **settings)


CASES: dict[str, Troubled] = {
    "healthy": Troubled(),
    "encoder 3 late by 8 ms, encoder 5 slips by 400 urad": Troubled(
        Trouble(lag_joint=3, lag_s=8e-3, slip_joint=5, slip_rad=4e-4, slip_s=30.0)
    ),
    "spots 3 ms older than their stamps": Troubled(Trouble(late_samples=3)),
    "PSD clock drifts by 400 us/s": Troubled(at_start=psd_clock(drift=4e-4)),
    "PSD clock set by 0.25 s": Troubled(later=((14, psd_clock(step_s=0.25)),)),
    "joint 1 swings at 7 Hz, damping 3 %": Troubled(Trouble(swing_hz=7.0, swing_damping=0.03, swing_rad=6e-5)),
    "joint 1 creeps 300 urad with 0.9 s": Troubled(Trouble(creep_rad=3e-4, creep_s=0.9)),
    "encoder 5 slips, PSD clock drifts, PSD frames are lost": Troubled(
        Trouble(slip_joint=5, slip_rad=4e-4, slip_s=20.0),
        at_start=psd_clock(drift=4e-4),
        later=((6, line("psd", "silence", 3)),),
        time_scale=8.0,
    ),
    "joint 1 swings, PSD clock is set": Troubled(
        Trouble(swing_hz=7.0, swing_damping=0.03, swing_rad=6e-5), later=((8, psd_clock(step_s=0.25)),), time_scale=8.0
    ),
    "frames lost, doubled and stale": Troubled(
        later=((6, line("psd", "silence", 3)), (10, line("can", "silence", 20)), (14, line("psd", "duplicate", 2)))
    ),
}


def lines(rig_file: Path, names: tuple[str, ...] = tuple(CASES)) -> Iterator[str]:
    """What was done, and what is said."""
    for name in names:
        yield f"{name}:"
        yield from lines_of(diagnosed(rig_file, CASES[name])[1])


def lines_of(file: DiagnosisFile) -> Iterator[str]:
    """Findings, what is usual and what cannot be seen, indented."""
    for one in file.findings:
        found = "in the samples" if one.stream is None else "found"
        yield f"  {found}: {one.physics} at {one.where}: {one.says}"
    yield from (f"  {text}" for text in stream_words(file))
