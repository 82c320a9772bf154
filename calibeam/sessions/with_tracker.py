"""A session with a tracker on site; paused and gone on with as any other.

Without a plan poses are drawn evenly over the joints' ranges, ordered by short ways, some of them repeated.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress as Bar

from acquisition.errors import AcquisitionError
from acquisition.recording import Event, RecordingError, RecordingWriter, RigFileError
from acquisition.recording.mcap import differs, next_part
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.control import RunState
from acquisition.session.stepping import Summary
from acquisition.session.tracked import TrackedOptions, TrackedSample, TrackedSession, check_tracked_plan
from acquisition.wires.tracker_bench import TrackerBench
from calibeam.asking import Asking
from calibeam.console import Console
from calibeam.devices.recorder import Earlier, RecordingJournal, end_event, kept, new_recording
from calibeam.devices.site import TrackerAddresses, connected_tracker
from calibeam.live.feed import SILENT, Feed, Progress
from calibeam.motion.reachable_poses import candidates_of, way_is_clear
from calibeam.outcome import INTERRUPTS, PartialResult
from calibeam.printing.progress import progress_bar
from calibeam.rig_files import of_one_point
from calibeam.sessions.job import GO_ON, PLAN_NOTE, SEED_NOTE, begun_in, plan_sha256
from calibeam.sessions.keys import Keys
from calibeam.sessions.measure import control_of
from calibeam.sessions.person import Person
from calibeam.sessions.reporter import StatusReporter
from calibeam.sessions.run import OnSite
from calibeam.sessions.views import PageLines, PlainView
from calibrate.model.arms.rig_arm import (
    RigArm,
)
from drivers.clock import Clock, SystemClock

Floats = NDArray[np.float64]
POSES_NOTE = "plan_poses"


@dataclass(frozen=True)
class TrackedJob:
    """From the command line. `plan` None: `poses` are drawn by `seed`."""

    rig: Rig
    text: str  # of the rig file
    out: Path
    addresses: TrackerAddresses
    plan: PosePlan | None = None
    poses: int = 40
    seed: int = 1
    plan_text: str = ""
    go_on: bool = False  # with the session in `out`


@dataclass(frozen=True)
class TakenBefore:
    """By earlier recordings of the session: poses of its plan, from 1, and how many samples that made."""

    plan: PosePlan
    notes: Mapping[str, str]
    done: frozenset[int] = frozenset()
    samples: int = 0

    @property
    def left(self) -> int:
        return self.plan.poses - len(self.done)


def taken_before(job: TrackedJob) -> TakenBefore:
    """What the session goes on with; its plan is that of its beginning, whatever --seed and --poses are now.

    RecordingError where there is none, or it is of another rig; AcquisitionError for another plan; RigFileError as
    `drawn_plan`.
    """
    notes = {SEED_NOTE: str(job.seed), POSES_NOTE: str(job.poses)}
    if job.plan is not None:
        notes = {PLAN_NOTE: plan_sha256(job.plan_text)}
    each = begun_in(job.out) if job.go_on else []
    if each:
        if said := differs(each[-1].rig, job.rig):
            raise RecordingError(f"{job.out}: its session was of another rig: {said}; begin one with another --out")
        begun = {name: each[0].notes[name] for name in (SEED_NOTE, POSES_NOTE, PLAN_NOTE) if name in each[0].notes}
        if begun.get(PLAN_NOTE) != notes.get(PLAN_NOTE):
            other = "another --plan" if PLAN_NOTE in begun and job.plan is not None else "other poses"
            raise AcquisitionError(f"{job.out}: the session was begun with {other}; go on with it was begun")
        notes = begun
    plan = job.plan or drawn_plan(job.rig, int(notes.get(POSES_NOTE, job.poses)), int(notes.get(SEED_NOTE, job.seed)))
    done = frozenset(int(e.detail["pose"]) for one in each for e in one.events if e.kind == "sample")
    samples = sum(len(one.samples) for one in each)
    if samples and not done:
        raise RecordingError(f"{job.out}: recorded by a version that did not record poses; begin with another --out")
    return TakenBefore(plan, notes, done, samples)


class WithTracker(OnSite):
    """Recording, model, diagnosis and report in `job.out`.

    `asking`: the terminal at which a person sits; `agrees`: who needs not be asked whether the arm may move.
    """

    def __init__(
        self, job: TrackedJob, console: Console, feed: Feed = SILENT, *, asking: Asking | None, agrees: bool
    ) -> None:
        if job.plan is not None:
            check_tracked_plan(job.plan)
        clock = SystemClock()
        reporter = StatusReporter(job.rig, clock, (PlainView(console), PageLines(feed)))
        person = Person(console, reporter, asking, agrees=agrees)
        super().__init__(job.rig, job.out, job.addresses.hurry, console, clock, person)
        self._job, self._feed = job, feed

    def _catch_up(self, *, failed: bool) -> None:
        self._before = taken_before(replace(self._job, go_on=self._job.go_on or failed))

    def _next_part(self) -> int:
        return self._before.left

    def _preview(self) -> None:
        before = self._before
        taken = f", {before.samples} taken before" if before.samples else ""
        self._reporter.report(f"session with a tracker, readings: {before.left}, repeats among them{taken}")
        if left_open := of_one_point(self._rig):
            self._reporter.report(left_open)

    def _measure(self) -> bool:
        job, before, path = self._job, self._before, next_part(self._out)
        self._reporter.step("measurement")
        try:
            with (
                new_recording(path, job.text, self._clock, before.notes) as writer,
                connected_tracker(job.rig, job.addresses, writer, self._clock, self._feed) as bench,
            ):
                summary = record_tracked(
                    bench,
                    job.rig,
                    writer,
                    before,
                    self._clock,
                    progress_bar(self._console),
                    feed=self._feed,
                    terminal=self._person.keyboard,
                    earlier=Earlier(self._out, before.samples),
                    reporter=self._reporter,
                )
        except PartialResult as early:
            self._reporter.ended_early(early)
            raise
        self._reporter.report(f"samples {len(summary.samples)}, skipped {summary.skipped}; recording: {path}")
        return False


def record_tracked(
    bench: TrackerBench,
    rig: Rig,
    writer: RecordingWriter,
    before: TakenBefore,
    clock: Clock,
    bar: Bar,
    options: TrackedOptions | None = None,
    feed: Feed = SILENT,
    terminal: int | None = None,
    earlier: Earlier | None = None,
    reporter: StatusReporter | None = None,
) -> Summary[TrackedSample]:
    """Take the poses that are left. PartialResult when it ended early: the arm stands, samples are kept.

    `terminal`: file descriptor that keys are read from: SPACE or Ctrl-C pauses, as in a session with detectors.
    """
    plan, reporter = before.plan, reporter or StatusReporter(rig, clock, ())
    with bar:
        task = bar.add_task("measuring", total=plan.poses, completed=len(before.done))

        def tell(done: int, total: int) -> None:
            bar.update(task, completed=done)
            feed.progress(Progress("measure", done, total))
            reporter.report(f"{done} of {total} poses", on_screen=False)

        def on_state(state: RunState) -> None:
            bar.update(task, description=state.value)
            if state in (RunState.PAUSED, RunState.RUNNING):
                writer.event(Event(clock.now_s(), "run state", {"state": state.value}))
            reporter.state(state)
            if state is RunState.PAUSED:
                reporter.report("r goes on, s ends here, a aborts")

        control = control_of(bench, clock, reporter, on_state)
        journal, home_rad = RecordingJournal(writer, clock), np.array(rig.motion.home_rad)
        session = TrackedSession(
            bench, journal, options or TrackedOptions(), home_rad, nominal_target(rig),
            tell=tell, control=control, done=before.done,
        )  # fmt: skip
        with Keys(control, terminal, clock):
            try:
                summary = kept(bench, writer, clock, session, lambda: session.run(plan), earlier)
            except PartialResult as early:
                INTERRUPTS.close()  # a recording is being closed
                raise PartialResult(f"{early}; {GO_ON}") from early.__cause__
    end_event(writer, clock, summary)
    return summary


def nominal_target(rig: Rig) -> Callable[[Floats], Floats]:
    """Positions (pose, 3) of the target in the base at readings (pose, joint), by the nominal arm."""
    arm, point_m = RigArm.of_rig(rig), np.array(rig.tool.point_m)

    def at(q_rad: Floats) -> Floats:
        flange = arm.frames(q_rad)[:, -1]
        return flange[:, :3, :3] @ point_m + flange[:, :3, 3]

    return at


SPARE = 3  # candidates for each pose that is wanted: of many the next one is near
PER_CANDIDATE = 6  # `candidates_of` draws so many for each that it is asked for
REPEATED_EVERY = 8  # poses: one of so many is taken twice more, each joint from either side


def drawn_plan(rig: Rig, poses: int, seed: int) -> PosePlan:
    """A plan of so many poses and their repeats, each the nearest one by a clear way from the one before.

    RigFileError where fewer can be reached.
    """
    if rig.device is None:
        raise RigFileError(
            f"rig {rig.name}: no [device]; poses are drawn for an instrument that stands somewhere, so give roughly "
            "where, or give a --plan"
        )
    rng = np.random.default_rng(seed)
    left = list(candidates_of(rig, -(-SPARE * poses // PER_CANDIDATE), rng).q_rad)
    at, chosen = np.array(rig.motion.home_rad), list[Floats]()
    while left and len(chosen) < poses:
        left.sort(key=lambda q: float(np.max(np.abs(q - at))))
        near = next((k for k, q in enumerate(left) if way_is_clear(rig, at, q)), None)
        if near is None:
            break
        at = left.pop(near)
        chosen.append(at)
    if len(chosen) < poses:
        raise RigFileError(
            f"rig {rig.name}: {len(chosen)} of {poses} poses are reached by clear ways from home; ask for fewer, or "
            "check home_rad and the boxes of [motion]"
        )
    return PosePlan(1, rig.name, (PlannedBlock(tuple(_with_repeats(chosen))),))


def _with_repeats(chosen: list[Floats]) -> list[PlannedPose]:
    out: list[PlannedPose] = []
    for number, q in enumerate(chosen):
        values = tuple(map(float, q))
        if number % REPEATED_EVERY != 0:
            out.append(PlannedPose(values))
            continue
        group = 1 + number // REPEATED_EVERY
        out += [PlannedPose(values, (way,) * len(values), repeat=group) for way in (1, -1, 1)]
    return out
