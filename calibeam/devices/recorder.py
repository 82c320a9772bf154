"""A session that is recorded: whatever happens, the arm is stopped and the file is whole.

The journal writes samples and events of the session into the recording.
"""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Protocol, TypeVar

import numpy as np
from rich.progress import Progress as Bar

from acquisition.bench import Bench
from acquisition.centring.camera.board import Sight
from acquisition.centring.loop import Limits
from acquisition.errors import AcquisitionError
from acquisition.recording import Event, RecordingError, RecordingWriter, read
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.plan import PlanOptions
from acquisition.session.records import Progress, Sample
from acquisition.session.session import Session
from acquisition.session.stepping import Summary
from acquisition.session.tracked import TrackedSample
from calibeam.emulation import EmulationError
from calibeam.learner import FittedLearner
from calibeam.outcome import ENDING, PartialResult, heard_by, interruption
from calibeam.software import SOFTWARE
from drivers.clock import Clock
from drivers.errors import DeviceError


class RecordingJournal:
    """Implements acquisition.session.records.Journal, of every driven session."""

    def __init__(self, writer: RecordingWriter, clock: Clock) -> None:
        self._writer, self._clock = writer, clock

    def sample(self, sample: Sample | TrackedSample) -> None:
        self._writer.sample(sample.row(), sample.look.host_s)

    def event(self, kind: str, detail: Mapping[str, Any]) -> None:
        self._writer.event(Event(self._clock.now_s(), kind, detail))


Result = TypeVar("Result")

Interrupted = (DeviceError, AcquisitionError, RecordingError, EmulationError, KeyboardInterrupt)


@contextmanager
def new_recording(path: Path, rig_text: str, clock: Clock, notes: Mapping[str, str]) -> Generator[RecordingWriter]:
    """A recording that is closed and readable at the end, whatever happens.

    Nothing is left of it when a device could not be had and no sample was taken: the next try may use the same name.
    """
    writer = RecordingWriter(path, rig_text=rig_text, software=SOFTWARE, clock=clock, notes=notes)
    try:
        yield writer
    except BaseException as why:
        with uninterrupted(), suppress(RecordingError):  # what ended the session is the news, not what follows from it
            writer.close(complete=False)
            if isinstance(why, DeviceError) and len(read(path).samples) == 0:
                path.unlink()
        raise
    with uninterrupted():
        writer.close()


class Counted(Protocol):
    """A session that reports how much it has taken, also after it was cut short."""

    @property
    def taken(self) -> int: ...


def record_session(
    bench: Bench,
    rig: Rig,
    writer: RecordingWriter,
    options: PlanOptions,
    clock: Clock,
    bar: Bar,
    plan: PosePlan | None = None,
    sight: Sight | None = None,
) -> Summary[Sample]:
    """Take every place of the rig, or the poses of a plan, with progress on `bar`; with a camera the light is aimed at
    by it.

    PartialResult when it ended early: the arm stands, samples are kept. Nobody is asked, and nothing can be paused:
    calibeam/sessions/with_detectors.py.
    """
    home_rad = np.array(rig.motion.home_rad)  # there is one: check_session
    with bar:
        task = bar.add_task("measurement", total=None)

        def tell(now: Progress) -> None:
            text = f"station {now.placement}, PSD {now.first} first: {now.phase.value}"
            bar.update(task, completed=now.done, total=now.total, description=text)

        limits, journal = Limits(step_rad=rig.motion.step_limit_rad), RecordingJournal(writer, clock)
        session = Session(bench, FittedLearner(rig), journal, options, home_rad, limits=limits, tell=tell, sight=sight)
        run = partial(session.run, tuple(rig.placements)) if plan is None else partial(session.take_planned, plan)
        summary = kept(bench, writer, clock, session, run)
        bar.update(task, completed=len(summary.samples))
    end_event(writer, clock, summary)
    return summary


def end_event(writer: RecordingWriter, clock: Clock, summary: Summary[Any]) -> None:
    """The session came to its end."""
    writer.event(Event(clock.now_s(), "end", {"samples": len(summary.samples), "skipped": summary.skipped}))


class Stoppable(Protocol):
    """A bench whose arm can be asked to stop."""

    def stop(self) -> None: ...


@dataclass(frozen=True)
class Earlier:
    """What the recording under way goes on with: the session's folder, and the samples of its earlier recordings."""

    folder: Path
    samples: int


def kept(
    bench: Stoppable,
    writer: RecordingWriter,
    clock: Clock,
    session: Counted,
    run: Callable[[], Result],
    earlier: Earlier | None = None,
) -> Result:
    """What `run` gives. PartialResult when it ended early: the arm stands, what was taken is on the disk.

    The message counts the samples of the whole session: with those that are `earlier`.
    """
    try:
        return run()
    except Interrupted as why:
        while True:
            try:
                ended = _ended_early(bench, writer, clock, session, why, earlier)
            except KeyboardInterrupt:  # in the moment before it is shut out: the arm has to be stopped all the same
                continue
            raise ended from why


def _ended_early(
    bench: Stoppable,
    writer: RecordingWriter,
    clock: Clock,
    session: Counted,
    why: BaseException,
    earlier: Earlier | None,
) -> PartialResult:
    """Stop the arm, put what there is on the disk; a second Ctrl-C may not get in between.

    The readers still run: whoever opened the recording closes it after them.
    """
    reason = stopped(bench, writer, clock, why)
    count, place, newest = session.taken, writer.path, ""
    if earlier is not None and earlier.samples:
        count, place = session.taken + earlier.samples, earlier.folder
        newest = f" ({session.taken} of them in {writer.path.name})"
    kept_text = f"samples kept in {place}: {count}{newest}"
    if count:
        kept_text += f"; `calibeam identify {place}` fits them"
    return PartialResult(f"{reason}; {kept_text}")


def stopped(bench: Stoppable, writer: RecordingWriter, clock: Clock, why: BaseException) -> str:
    """Stops the arm, puts what there is on the disk; why it ended, and what of this failed, in one line."""
    reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
    also: list[str] = []
    with uninterrupted():
        try:
            bench.stop()
        except DeviceError as error:
            also.append(f"the stop command to the arm failed ({error}); check that the arm stands still")
        try:
            writer.event(Event(clock.now_s(), "ended early", {"why": reason}))
            writer.flush()
        except RecordingError as error:
            also.append(str(error))
    return "; ".join([reason, *dict.fromkeys(also)])


@contextmanager
def uninterrupted() -> Generator[None, None, None]:
    """Ctrl-C and the end of the terminal wait outside: half of a clean-up is worse than a second's patience."""

    def ignore(number: int, frame: FrameType | None) -> None:
        return

    with heard_by(dict.fromkeys(ENDING, ignore)):
        yield
