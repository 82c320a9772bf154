"""A session that is recorded: runs the plan, and whatever happens the arm is stopped and the file is whole."""

import signal
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from acquisition.bench import Bench
from acquisition.errors import AcquisitionError
from acquisition.plan import PlanOptions
from acquisition.recording.errors import RecordingError
from acquisition.recording.rig_schema import Rig
from acquisition.recording.stream import Event
from acquisition.recording.writer import RecordingWriter
from acquisition.servo.centring import Limits
from acquisition.session import Session, Summary
from calibeam.journal import RecordingJournal
from calibeam.learner import FittedLearner
from calibeam.outcome import PartialResult
from drivers.clock import Clock
from drivers.errors import DeviceError

Interrupted = (DeviceError, AcquisitionError, RecordingError, KeyboardInterrupt)


def record_session(
    bench: Bench, rig: Rig, writer: RecordingWriter, options: PlanOptions, clock: Clock, console: Console
) -> Summary:
    """Take every place of the rig. PartialResult when it ended early: the arm stands, what was taken is kept."""
    home_rad = np.zeros(rig.n_joints) if rig.motion.home_rad is None else np.array(rig.motion.home_rad)
    with _progress(console) as progress:
        task = progress.add_task("collecting", total=None)

        def tell(done: int, total: int, text: str) -> None:
            progress.update(task, completed=done, total=total, description=text)

        session = Session(
            bench,
            FittedLearner(rig),
            RecordingJournal(writer, clock),
            options,
            home_rad,
            limits=Limits(step_rad=rig.motion.step_limit_rad),
            progress=tell,
        )
        try:
            summary = session.run(tuple(rig.placements))
        except Interrupted as why:
            raise _ended_early(bench, writer, clock, session, why) from why
    writer.event(Event(clock.now_s(), "end", {"samples": len(summary.samples), "skipped": summary.skipped}))
    return summary


def _ended_early(
    bench: Bench, writer: RecordingWriter, clock: Clock, session: Session, why: BaseException
) -> PartialResult:
    """Stop the arm, put what there is on the disk; a second Ctrl-C may not get in between.

    The readers still run: whoever opened the recording closes it after them.
    """
    reason = "stopped by Ctrl-C" if isinstance(why, KeyboardInterrupt) else str(why)
    also: list[str] = []
    with uninterrupted():
        try:
            bench.stop()
        except DeviceError as error:
            also.append(f"the arm could not be told to stop ({error}); see that it stands")
        try:
            writer.event(Event(clock.now_s(), "ended early", {"why": reason}))
            writer.flush()
        except RecordingError as error:
            also.append(str(error))
    kept = f"{session.taken} samples are kept in {writer.path}"
    return PartialResult("; ".join([reason, *dict.fromkeys(also), kept]))


@contextmanager
def uninterrupted() -> Generator[None, None, None]:
    """Ctrl-C waits outside: cleaning up is short, and half of it is worse than a second's patience."""

    def ignore(number: int, frame: FrameType | None) -> None:
        return

    before = signal.signal(signal.SIGINT, ignore)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        transient=False,
    )


def fresh(folder: Path, names: tuple[str, ...]) -> None:
    """Make the folder, and take away results of an earlier run by the same names."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).unlink(missing_ok=True)
