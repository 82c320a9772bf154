"""A session on paper: every pose of its plan and the way there, gone through the gate before the arm moves.

Poses are where the rig file assumes arm and places to be. The arm that is met is known better from pose to pose, so
the true ways differ by what zeros of degrees do; each passes the same gate again when it is made.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.aim import BeamTarget, flange_for, reach
from acquisition.centring.navigator import FINDING_STAND_OFF_M
from acquisition.errors import RefusedMotionError, UnreachableError
from acquisition.motion.gated_arm import GatedArm
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from acquisition.session.plan import PlanOptions, blocks
from calibeam.learner import FittedLearner
from calibeam.motion.gate_of_rig import cell_of
from calibrate.model.arms.rig_arm import RigArm

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RehearsedPose:
    """One pose of a plan: where, and the readings (joint,); `why`: it cannot be had."""

    placement: int | None
    name: str
    q_rad: Floats | None
    why: str = ""


@dataclass(frozen=True, eq=False)
class Rehearsal:
    """The stops in order; `ways` (pose, joint) from one that was had to the next, `places` their fixture places."""

    arm: RigArm
    home_rad: Floats
    stops: tuple[RehearsedPose, ...]
    ways: tuple[Floats, ...]
    places: tuple[int | None, ...]

    @property
    def refused(self) -> tuple[RehearsedPose, ...]:
        return tuple(stop for stop in self.stops if stop.why)

    @property
    def says(self) -> str:
        """For a person, the first refused pose with its reason."""
        places = len({stop.placement for stop in self.stops})
        told = f"{len(self.stops)} poses at {places} station{'' if places == 1 else 's'}"
        if not self.refused:
            return f"{told}, all within reach and clear of the keep-out boxes"
        first = self.refused[0]
        return f"{told}, {len(self.refused)} of them are not possible, the first: {first.name}: {first.why}"


@dataclass
class PaperArm:
    """Implements drivers.device.Movable: it is where it was sent, at once."""

    q_rad: Floats
    name: str = "robot"
    ways: list[Floats] = field(default_factory=list[Floats])

    def connect(self) -> None: ...

    def move_joints(self, q_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        self.ways.append(np.stack([self.q_rad, q_rad]))
        self.q_rad = q_rad

    def stop(self, deceleration_rad_s2: float = 0.0) -> None: ...

    def hold(self) -> None: ...

    def close(self) -> None: ...


def rehearse(rig: Rig, options: PlanOptions, plan: PosePlan | None = None) -> Rehearsal:
    """What a session of `options`, or of a plan of poses, is about to do, from the rig's home_rad on."""
    arm = RigArm.of_rig(rig)
    home_rad = np.zeros(rig.n_joints) if rig.motion.home_rad is None else np.array(rig.motion.home_rad)
    paper = PaperArm(home_rad)
    gated = GatedArm(paper, arm, cell_of(rig), lambda: paper.q_rad)
    stops, places = list[RehearsedPose](), list[int | None]()
    wanted = _aimed(rig, options, paper) if plan is None else _planned(plan)
    for stop in wanted:
        said = stop
        if stop.q_rad is not None:
            try:
                gated.move_joints(stop.q_rad, rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
                places.append(stop.placement)
            except RefusedMotionError as why:
                said = RehearsedPose(stop.placement, stop.name, stop.q_rad, str(why))
        stops.append(said)
    return Rehearsal(arm, home_rad, tuple(stops), tuple(paper.ways), tuple(places))


def _aimed(rig: Rig, options: PlanOptions, paper: PaperArm) -> Iterator[RehearsedPose]:
    """Poses of a session that aims: every block begins where the light is looked for."""
    learner, rng = FittedLearner(rig), np.random.default_rng(options.seed)
    for block in blocks(tuple(rig.placements), learner.optics.half_size_m, options):
        T = learner.T_base_fixture(block.placement)
        finding = BeamTarget(block.first, (0.0, 0.0, 0.0, 0.0), FINDING_STAND_OFF_M, block.visits[0].target.roll_rad)
        targets = [("the aim", finding), *((f"pose {visit.index + 1}", visit.target) for visit in block.visits)]
        for number, target in targets:
            name = f"station {block.placement}, PSD {block.first} first, {number}"
            try:
                q_rad = reach(learner.arm, flange_for(learner.arm, learner.optics, T, target), paper.q_rad, rng)
            except UnreachableError as why:
                yield RehearsedPose(block.placement, name, None, str(why))
                continue
            yield RehearsedPose(block.placement, name, q_rad)


def _planned(plan: PosePlan) -> Iterable[RehearsedPose]:
    for number, block in enumerate(plan.block, start=1):
        for index, pose in enumerate(block.pose, start=1):
            yield RehearsedPose(block.placement, f"block {number}, pose {index}", np.array(pose.q_rad))
