"""A session of explicit joint poses: go there, from the asked-for side, and read; where it is dark, find the light."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench
from acquisition.centring.aim import clear_of_table
from acquisition.centring.camera.board import Sight
from acquisition.centring.navigator import GLANCE_S, Navigator
from acquisition.errors import AcquisitionError, NoLightError, SpotLostError, UnreachableError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.session.control import EndedEarlyError, RunControl, RunEvent
from acquisition.session.plan import PlanOptions, PoseKey
from acquisition.session.records import Journal, Learner, Phase, Progress, Sample, Tell, key_detail, silent
from acquisition.session.session import NOTHING, Summary, Taken, usable
from acquisition.session.stepping import InterruptibleBench, Stepping

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


class PlannedSession:
    """Runs a plan on a bench; the only owner of what was taken. Stopping the arm after an error is the caller's.

    `earlier`: what other parts of this session have taken; it is not taken again.
    """

    def __init__(
        self,
        bench: Bench,
        learner: Learner,
        journal: Journal,
        options: PlanOptions,
        home_rad: Floats,
        *,
        tell: Tell = silent,
        sight: Sight | None = None,
        control: RunControl | None = None,
        earlier: Taken = NOTHING,
    ) -> None:
        self._control = control or RunControl(bench.stop)
        self._bench = InterruptibleBench(bench, self._control)
        self._learner, self._journal, self._options = learner, journal, options
        self._navigator = Navigator(self._bench, learner, journal, home_rad, options.seed, sight, options.centring)
        self._stepping = Stepping(self._control, self._bench, self._navigator, lambda: None)
        self._tell, self._earlier = tell, {key.index: sample for key, sample in earlier.items()}
        self._samples: list[Sample] = []
        self._skipped = 0

    @property
    def taken(self) -> int:
        """Samples so far, also after the session was cut short."""
        return len(self._samples)

    def run(self, plan: PosePlan, standing: int | None = None) -> Summary:
        """Take every block. DeviceError, RecordingError end it; a pose that is dark or out of reach is skipped.

        `standing`: the place where the fixture is already.
        """
        check_planned(plan)
        self._control.tell(RunEvent.START)
        try:
            self._stepping.step(lambda: self._navigator.move(self._navigator.q_rad))
            index = 0
            for block in plan.block:
                poses = list(enumerate(block.pose, start=index))
                index += len(poses)
                left = [(number, pose) for number, pose in poses if number not in self._earlier]
                if left and block.placement != standing:
                    standing = self._place(plan, block)
                for number, pose in left:
                    self._say(plan, block, Phase.COLLECT)
                    self._stepping.step(partial(self._take, block, pose, number))
        except EndedEarlyError:
            self._journal.event("ended by a person", {"samples": self.taken})
        self._control.finish()
        return Summary(tuple(self._samples), (), self._skipped)

    def _place(self, plan: PosePlan, block: PlannedBlock) -> int:
        placement = block.placement or 0
        self._say(plan, block, Phase.PLACE)
        self._bench.place_fixture(placement)
        self._journal.event("placement", {"id": placement})
        return placement

    def _take(self, block: PlannedBlock, pose: PlannedPose, number: int) -> None:
        placement, first = block.placement or 0, block.first_psd or 1
        try:
            self._go(pose, placement, first)
        except (UnreachableError, SpotLostError, NoLightError) as why:
            return self._skip(placement, str(why))
        look = self._bench.look(self._options.dwell_s)
        if not usable(look):
            return self._skip(placement, "no light, or saturated, when read")
        sample = Sample(look, placement, first, self._navigator.approach.copy(), pose.repeat, centred=False)
        self._samples.append(sample)
        self._journal.sample(sample)
        self._journal.event("sample", key_detail(PoseKey(placement, first, number), look))
        return None

    def _go(self, pose: PlannedPose, placement: int, first: int) -> None:
        """To the pose from its side; where it is dark there, to light near it and the spots that were expected."""
        q_rad = np.array(pose.q_rad)
        if not clear_of_table(self._learner.arm, q_rad):
            at_rad = (np.round(q_rad, 3) + 0.0).tolist()
            raise UnreachableError(f"pose {at_rad} rad: elbow, wrist or laser would touch the table")
        self._approach(q_rad, pose)
        if not all(self._bench.look(GLANCE_S).lit(first)):
            found_rad = self._navigator.find_near(placement, first, pose.spots_m or (0.0, 0.0, 0.0, 0.0))
            self._approach(found_rad, pose)

    def _approach(self, q_rad: Floats, pose: PlannedPose) -> None:
        """Every joint that has a way comes this way, from inside its range."""
        way = np.array(pose.approach or np.zeros(len(q_rad)))
        before = q_rad - self._options.opposite_rad * way
        arm = self._learner.arm
        if np.any(way) and np.all((before >= arm.lower_rad) & (before <= arm.upper_rad)):
            self._navigator.move(before)
        self._navigator.move(q_rad)

    def _skip(self, placement: int, why: str) -> None:
        self._journal.event("skipped", {"placement": placement, "why": why})
        self._skipped += 1

    def _say(self, plan: PosePlan, block: PlannedBlock, phase: Phase) -> None:
        done = len(self._earlier) + len(self._samples)
        self._tell(Progress(phase, done, plan.poses, self._skipped, block.placement or 0, block.first_psd or 1))
