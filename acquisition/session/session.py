"""A session before two detectors: for every place and order find the light, centre, collect, repeat; learn the arm on
the way; or take the joint poses of a plan.

A pose that was broken off by a pause is taken again; what an earlier part of the same session has taken is not taken
twice. To a pose of a plan the arm goes from the asked-for side; where it is dark, the light is searched for.
"""

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.aim import AssumedArm, clear_of_table
from acquisition.centring.camera.board import Sight
from acquisition.centring.loop import CentringStatus, Limits
from acquisition.centring.navigator import GLANCE_S, Navigator
from acquisition.errors import AcquisitionError, NoLightError, SpotLostError, UnreachableError
from acquisition.recording.pose_plan import PlannedPose, PosePlan
from acquisition.session.control import RunControl
from acquisition.session.plan import Block, PlanOptions, PoseKey, Visit, blocks
from acquisition.session.records import Journal, Learner, Phase, Progress, Sample, Tell, key_detail, silent
from acquisition.session.stepping import DISPLACED_RAD, DrivenSession, InterruptibleBench, Steps, Summary

Floats = NDArray[np.float64]


def check_planned(plan: PosePlan) -> None:
    """AcquisitionError where a session before two detectors cannot take a block as it is asked for."""
    for number, block in enumerate(plan.block, start=1):
        if block.placement is None or block.first_psd is None:
            raise AcquisitionError(
                f"block {number} of the plan names no placement and first_psd: a session takes poses before the two "
                "detectors; take these by hand, and record them as rows of samples.csv"
            )
        if block.payload_kg:
            raise AcquisitionError(
                f"block {number} of the plan wants a payload of {block.payload_kg:g} kg: a session changes none; "
                "take these poses by hand, or leave the block out"
            )


def go_to_planned(navigator: Navigator, arm: AssumedArm, pose: PlannedPose, key: PoseKey, opposite_rad: float) -> None:
    """To the pose from its side; where it is dark there, to light near it and the spots that were expected."""
    q_rad = np.array(pose.q_rad)
    if not clear_of_table(arm, q_rad):
        at_rad = (np.round(q_rad, 3) + 0.0).tolist()
        raise UnreachableError(f"pose {at_rad} rad: elbow, wrist or laser would touch the table")
    _approach(navigator, arm, q_rad, pose, opposite_rad)
    if navigator.dark(key.first):
        found_rad = navigator.find_near(key.placement, key.first, pose.spots_m or (0.0, 0.0, 0.0, 0.0))
        _approach(navigator, arm, found_rad, pose, opposite_rad)


def _approach(navigator: Navigator, arm: AssumedArm, q_rad: Floats, pose: PlannedPose, opposite_rad: float) -> None:
    """Every joint that has a way comes this way, from inside its range."""
    way = np.array(pose.approach or np.zeros(len(q_rad)))
    before = q_rad - opposite_rad * way
    if np.any(way) and np.all((before >= arm.lower_rad) & (before <= arm.upper_rad)):
        navigator.move(before)
    navigator.move(q_rad)


Before = Mapping[PoseKey, Sample]

LEARN_EVERY = 5  # samples between refits while the arm is still strange
LEARN_FAST_UNTIL = 30  # after that a refit at the end of every block is enough
NOTHING: Before = {}


class Session(DrivenSession[Sample]):
    """Takes blocks of visits, or the poses of a plan.

    `earlier`: what other parts of this session have taken; the arm is known from it, and it is not taken again.
    """

    def __init__(
        self,
        bench: Bench,
        learner: Learner,
        journal: Journal[Sample],
        options: PlanOptions,
        home_rad: Floats,
        *,
        limits: Limits | None = None,
        tell: Tell = silent,
        sight: Sight | None = None,
        control: RunControl | None = None,
        earlier: Before = NOTHING,
    ) -> None:
        super().__init__(journal, control or RunControl(bench.stop))
        self._bench = InterruptibleBench(bench, self._control)
        self._learner, self._options = learner, options
        self._navigator = Navigator(self._bench, learner, journal, home_rad, options.seed, sight, options.centring)
        self._limits, self._tell, self._earlier = limits or Limits(), tell, earlier
        self._keys: dict[PoseKey, Sample] = {}
        self._learned = self._total = self._before = 0
        self._standing: int | None = None
        self._lit: tuple[int, int] | None = None  # place and order at which the light is found

    def run(self, placements: tuple[int, ...]) -> Summary[Sample]:
        """Take every block of the plan. DeviceError, NoLightError, UnreachableError, RecordingError end it."""
        return self.take(tuple(blocks(placements, self._learner.optics.half_size_m, self._options)))

    def take(self, plan: Sequence[Block], standing: int | None = None) -> Summary[Sample]:
        """Take these blocks, and after them perhaps others; `standing`: the place where the fixture is already."""
        self._standing = self._standing if standing is None else standing
        keys = [key for block in plan for key in block.pose_keys()]
        self._total += len(keys)
        self._before += sum(key in self._earlier for key in keys)
        return self._run(self._visits(plan))

    def take_planned(self, plan: PosePlan, standing: int | None = None) -> Summary[Sample]:
        """Go to explicit joint poses, each from its side, and read; where it is dark, find the light. AcquisitionError
        where it cannot be taken as it is asked for; DeviceError, RecordingError end it; a pose that is dark or out of
        reach is skipped. `standing` as above.
        """
        check_planned(plan)
        self._standing, self._total, self._before = standing, plan.poses, len(self._earlier)
        return self._run(self._planned(plan))

    def _visits(self, plan: Sequence[Block]) -> Steps:
        yield self._go_home
        if self._earlier and not self._samples:
            self._learner.learn(list(self._earlier.values()))
        for block in plan:
            if all(key in self._earlier for key in block.pose_keys()):
                continue
            self._place(block.placement, block.first)
            for visit in block.visits:
                if visit.key() not in self._earlier:
                    yield partial(self._visit, block, visit)
                    known = len(self._earlier) + len(self._samples)
                    if known <= LEARN_FAST_UNTIL and len(self._samples) - self._learned >= LEARN_EVERY:
                        self._learn()
            for visit in block.visits:
                if visit.repeat is not None:
                    yield from self._repeats(visit)
            self._learn()

    def _repeats(self, visit: Visit) -> Steps:
        sample = self._keys.get(visit.key()) or self._earlier.get(visit.key())
        for again in (1, 2):
            if sample is not None and visit.key(again) not in self._earlier:
                yield partial(self._again, visit, sample, again)

    def _planned(self, plan: PosePlan) -> Steps:
        yield self._go_home
        taken, index = {key.index for key in self._earlier}, 0
        for block in plan.block:
            left = [(number, pose) for number, pose in enumerate(block.pose, start=index) if number not in taken]
            index += len(block.pose)
            placement, first = block.placement or 0, block.first_psd or 1
            if left:
                self._place(placement, first)
            for number, pose in left:
                self._say(Phase.COLLECT, placement, first)
                yield partial(self._take_pose, pose, PoseKey(placement, first, number))

    def _go_home(self) -> None:
        self._navigator.move(self._navigator.q_rad)

    def _place(self, placement: int, first: int) -> None:
        if placement != self._standing:
            self._say(Phase.PLACE, placement, first)
            self._bench.place_fixture(placement)
            self._journal.event("placement", {"id": placement})
            self._standing = placement

    def _visit(self, block: Block, visit: Visit) -> None:
        """Go to one pose and record it; skipped, and noted in the journal, where that cannot be done."""
        if self._lit != (block.placement, block.first):
            self._say(Phase.AIM, block.placement, block.first)
            self._navigator.find(block.placement, block.first, block.visits[0].target.roll_rad)
            self._lit = (block.placement, block.first)
        self._say(Phase.CENTRE if visit.centred else Phase.COLLECT, block.placement, block.first)
        lost = 0 if visit.repeat is None else 2  # repeats, which cannot be taken without it
        try:
            run = self._navigator.visit(visit.target, self._limits if visit.centred else None)
        except (UnreachableError, SpotLostError) as why:
            self._skip({"placement": visit.placement}, str(why))
            self._total -= lost
            return
        centred = visit.centred and run.status is CentringStatus.CENTRED
        if not self._read(visit.key(), visit.repeat, centred=centred):
            self._skipped += 1
            self._total -= lost
        if centred:
            self._steps.append(run.steps)

    def _again(self, visit: Visit, sample: Sample, again: int) -> None:
        """The same command again; every joint comes the way it came the first time, or the opposite way."""
        self._say(Phase.REPEAT, visit.placement, visit.target.first)
        way = -sample.approach if again == 1 else sample.approach
        try:
            self._navigator.move(sample.look.cmd_rad + self._options.opposite_rad * way)
            self._navigator.move(sample.look.cmd_rad)
        except UnreachableError as why:  # the pose was had, but not every way to it is free
            self._skip({"placement": visit.placement}, str(why))
            self._total -= 1
            return
        self._read(visit.key(again), visit.repeat, centred=sample.centred)

    def _take_pose(self, pose: PlannedPose, key: PoseKey) -> None:
        try:
            go_to_planned(self._navigator, self._learner.arm, pose, key, self._options.opposite_rad)
        except (UnreachableError, SpotLostError, NoLightError) as why:
            self._skip({"placement": key.placement}, str(why))
            return
        if not self._read(key, pose.repeat, centred=False):
            self._skipped += 1

    def _read(self, key: PoseKey, repeat: int | None, *, centred: bool) -> bool:
        """Whether there was a usable reading; it is recorded then."""
        look = self._bench.look(self._options.dwell_s)
        if not usable(look):
            why = "no light, or saturated, when read"
            self._journal.event("skipped", {"placement": key.placement, "why": why})
            return False
        sample = Sample(look, key.placement, key.first, self._navigator.approach.copy(), repeat, centred)
        self._keys[key] = sample
        self._keep(sample, key_detail(key, look))
        return True

    def _learn(self) -> None:
        self._learner.learn([*self._earlier.values(), *self._samples])
        self._learned = len(self._samples)
        self._navigator.relearned()

    def _come_back(self) -> None:
        """To where the last step ended, slowly as every motion."""
        back_rad = self._navigator.q_rad - self._bench.look(GLANCE_S).q_rad
        if float(np.max(np.abs(back_rad))) <= DISPLACED_RAD:
            return
        self._astray()
        came = np.where(np.abs(back_rad) > DISPLACED_RAD, np.sign(back_rad), self._navigator.approach)
        self._navigator.move(self._navigator.q_rad)
        self._navigator.approach = came.astype(np.int64)

    def _astray(self) -> None:
        self._lit = None

    def _say(self, phase: Phase, placement: int, first: int) -> None:
        done = self._before + len(self._samples)
        self._tell(Progress(phase, done, self._total, self._skipped, placement, first))


def usable(look: Look) -> bool:
    """Whether both faces have light, and none too much."""
    return all(face.lit and not face.saturated for face in (look.psd1, look.psd2))
