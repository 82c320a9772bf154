"""One part of a session measured: devices connected and recorded, the plan taken under run control, with forecasts."""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from acquisition.centring.camera.board import Sight
from acquisition.centring.loop import Limits
from acquisition.recording import Event, RecordingWriter
from acquisition.session.control import RunControl, RunState
from acquisition.session.plan import Block
from acquisition.session.records import Sample
from acquisition.session.session import Session
from acquisition.session.stepping import Summary
from acquisition.wires.bench import ArmOnWires, WiredBench
from calibeam.devices.instruments import camera_sight
from calibeam.devices.recorder import Earlier, RecordingJournal, end_event, kept, new_recording
from calibeam.devices.site import connected
from calibeam.learner import FittedLearner
from calibeam.live.feed import Feed
from calibeam.outcome import INTERRUPTS, PartialResult
from calibeam.sessions.forecast import Ahead, Asked, Forecaster, forecast
from calibeam.sessions.job import STANDS_IN, Job, Part, notes_of
from calibeam.sessions.keys import Keys
from calibeam.sessions.person import Person
from calibeam.sessions.reporter import ReportingJournal, StatusReporter
from calibeam.sessions.status import Forecast
from drivers.clock import Clock

FORECAST_EVERY = 5  # poses; one takes a tenth of a second, in a thread of its own


class Measuring:
    """A part under way: `take` its plan, then more where that is wanted. Owns the samples of the part."""

    def __init__(
        self,
        job: Job,
        part: Part,
        ahead: Ahead,
        bench: WiredBench,
        writer: RecordingWriter,
        clock: Clock,
        people: tuple[StatusReporter, Person],
        sight: Sight | None = None,
    ) -> None:
        self._job, self._part, self._ahead = job, part, ahead
        self._bench, self._writer, self._clock = bench, writer, clock
        self._reporter, self._person = people
        self._samples: list[Sample] = []
        self._forecaster = Forecaster(self._forecast, self._no_forecast)
        self._control = control_of(
            bench,
            clock,
            self._reporter,
            self._reporter.state,
            lambda rests_in_s, eased: self._reporter.pausing(rests_in_s, bench.ease_s if eased else None),
        )
        self._session = self._session_of(sight)

    def take(self, more: Sequence[Block] = ()) -> Summary[Sample]:
        """All that was taken in this part so far. PartialResult when it ended early: the arm stands."""
        with Keys(self._control, self._person.keyboard) as keys, self._person.at(keys), self._forecaster.running():
            try:
                earlier = Earlier(self._job.out, len(self._part.earlier.taken))
                summary = kept(self._bench, self._writer, self._clock, self._session, self._run(more), earlier)
            except PartialResult as early:
                INTERRUPTS.close()  # a recording is being closed
                self._reporter.ended_early(early)
                raise
        end_event(self._writer, self._clock, summary)
        return summary

    def forecast_now(self) -> Forecast:
        """With all samples; ahead is what was not taken."""
        return self._made(Asked(list(self._samples), self._behind()))

    @property
    def placement(self) -> int | None:
        """Where the fixture stands."""
        return self._samples[-1].placement if self._samples else self._part.earlier.standing

    def _session_of(self, sight: Sight | None) -> Session:
        rig, options, earlier = self._part.rig, self._job.options, self._part.earlier.taken
        journal = ReportingJournal(RecordingJournal(self._writer, self._clock), self._reporter, self._took)
        learner, home_rad = FittedLearner(rig), np.array(rig.motion.home_rad)
        tell, limits, control = self._reporter.progress, Limits(step_rad=rig.motion.step_limit_rad), self._control
        return Session(
            self._bench, learner, journal, options, home_rad,
            limits=limits, tell=tell, sight=sight, control=control, earlier=earlier,
        )  # fmt: skip

    def _run(self, more: Sequence[Block]) -> Callable[[], Summary[Sample]]:
        standing = None if self._samples else self._part.earlier.standing
        if self._part.plan is not None:
            return partial(self._session.take_planned, self._part.plan, standing)
        return partial(self._session.take, more or self._part.blocks, standing)

    def _took(self, samples: list[Sample]) -> None:
        self._samples = samples
        if len(samples) % FORECAST_EVERY == 0:
            self._forecaster.ask(Asked(list(samples), self._behind()))

    def _behind(self) -> int:
        progress = self._reporter.shown.progress
        return 0 if progress is None else progress.done + progress.skipped

    def _forecast(self, asked: Asked) -> None:
        self._reporter.forecast(self._made(asked))

    def _made(self, asked: Asked) -> Forecast:
        taken = [*self._part.earlier.taken.values(), *asked.samples]
        return forecast(self._part.rig, taken, self._ahead.after(asked.taken_of_plan), self._job.goal_m)

    def _no_forecast(self, why: Exception) -> None:
        self._reporter.report(f"no more forecasts in this session: {type(why).__name__}: {why}", on_screen=False)


@contextmanager
def measuring(
    job: Job, part: Part, ahead: Ahead, path: Path, clock: Clock, people: tuple[StatusReporter, Person], feed: Feed
) -> Generator[Measuring]:
    """Devices connected, the recording begun. DeviceError, RecordingError, and what `camera_sight` raises."""
    mover = partial(_asked_for, part, people[1]) if job.place is None else partial(_emulated, part, job.place)
    with (
        new_recording(path, part.text, clock, notes_of(job, part.seed)) as writer,
        camera_sight(part.rig, clock) as sight,
        connected(part.rig, job.addresses, writer, clock, mover, feed) as bench,
    ):
        feed.measures(part.rig)
        for place in part.earlier.added:
            instead_of = next((k for k, v in part.earlier.stands_in.items() if v == place.id), None)
            writer.event(Event(clock.now_s(), STANDS_IN, {"id": place.id, "instead_of": instead_of}))
        yield Measuring(job, part, ahead, bench, writer, clock, people, sight)


def control_of(
    bench: ArmOnWires,
    clock: Clock,
    reporter: StatusReporter,
    changed: Callable[[RunState], None],
    pausing: Callable[[float, bool], None] = lambda rests_in_s, eased: None,
) -> RunControl:
    """Of an arm on wires, as every session has it. `changed`, `pausing`: as of RunControl."""
    return RunControl(
        bench.stop,
        clock,
        lambda: bench.supervisor.failure,
        changed,
        hold_arm=bench.hold,
        undelivered=reporter.undelivered,
        rests_in_s=bench.rests_in_s,
        ease_arm=bench.ease,
        pausing=pausing,
    )


def _emulated(part: Part, place: Callable[[int], None], placement: int) -> None:
    """An emulated fixture knows the places of the rig file only: one that was measured again is where it was."""
    origin = {new: old for old, new in part.earlier.stands_in.items()}
    while placement in origin:
        placement = origin[placement]
    place(placement)


def _asked_for(part: Part, person: Person, placement: int) -> None:
    """Has a person place the fixture."""
    where = ", ".join(f"{value:.3f}" for value in part.rig.placements[placement].psd1_in_base.origin_m)
    person.place(f"put the fixture at station {placement} (PSD 1 near {where} m in the base)")
