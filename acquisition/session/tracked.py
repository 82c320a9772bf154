"""A session with a tracker: poses of a plan, each from its side, read once the target has settled.

Between two poses it may be paused; a pose that was broken off is taken again, from where the arm then stands.
"""

from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import ReadingBench
from acquisition.errors import AcquisitionError, RefusedMotionError
from acquisition.recording.pose_plan import PlannedPose, PosePlan
from acquisition.recording.samples import Cell
from acquisition.session.control import RunControl
from acquisition.session.records import Journal, row_of
from acquisition.session.stepping import DISPLACED_RAD, DrivenSession, Steps, Summary
from acquisition.wires.tracker_bench import TargetLook

Floats = NDArray[np.float64]
MOVED_RAD = 1e-6  # by which a joint counts as having moved
SPREAD_FROM = 4  # samples: from so many on, wrong units show in how far the readings spread
GLANCE_S = 0.05  # of a reading of where the arm stands after a pause
LEAST_SPREAD_M = 0.02  # of the nominal positions; less shows nothing about units
SPREADS = (0.5, 2.0)  # measured over nominal: arms are drawn to 1 %, units are wrong by 25 and more


@dataclass(frozen=True)
class TrackedSample:
    """A row of samples.csv in the making."""

    look: TargetLook
    approach: NDArray[np.int64]  # (joint,) -1, 0, +1: the way each joint last moved
    repeat: int | None

    def row(self) -> dict[str, Cell]:
        """Column name -> value."""
        read = dict[str, Cell](zip(("x_m", "y_m", "z_m"), self.look.position_m.tolist(), strict=True))
        return row_of(self.look, self.approach, self.repeat, read)


@dataclass(frozen=True)
class TrackedOptions:
    """How every pose is taken."""

    dwell_s: float = 0.5
    opposite_rad: float = 0.035  # from how far a joint comes that has a side to come from


def check_tracked_plan(plan: PosePlan) -> None:
    """AcquisitionError where a session with a tracker cannot take a block as it is asked for."""
    for number, block in enumerate(plan.block, start=1):
        if block.placement is not None or block.seat is not None or block.payload_kg:
            raise AcquisitionError(
                f"block {number} of the plan names a placement, a seat or a payload: a session with a tracker changes "
                "nothing but the pose; take these poses by hand, or leave the block out"
            )


class TrackedSession(DrivenSession[TrackedSample]):
    """Takes the poses of a plan.

    `nominal_m`: positions (pose, 3) of the target by the nominal arm, at joint readings (pose, joint), in the base.
    `control`: how a person pauses and ends it; None: nobody does. `done`: poses of the plan, from 1, that were taken
    before.
    """

    def __init__(
        self,
        bench: ReadingBench[TargetLook],
        journal: Journal[TrackedSample],
        options: TrackedOptions,
        home_rad: Floats,
        nominal_m: Callable[[Floats], Floats],
        *,
        tell: Callable[[int, int], None] = lambda done, total: None,
        control: RunControl | None = None,
        done: Collection[int] = (),
    ) -> None:
        super().__init__(journal, control or RunControl(bench.stop))
        self._bench, self._options, self._tell = bench, options, tell
        self._home_rad, self._nominal_m, self._done = home_rad, nominal_m, frozenset(done)
        self._at_rad: Floats | None = None
        self._approach = np.zeros(len(home_rad), dtype=np.int64)

    def run(self, plan: PosePlan) -> Summary[TrackedSample]:
        """Home, every pose that is left, home. DeviceError, AcquisitionError, RecordingError end it."""
        check_tracked_plan(plan)
        return self._run(self._poses(plan))

    def _poses(self, plan: PosePlan) -> Steps:
        yield partial(self._move, self._home_rad)
        for number, pose in enumerate((pose for block in plan.block for pose in block.pose), start=1):
            if number not in self._done:
                yield partial(self._take, number, pose)
                self._tell(len(self._done) + len(self._samples) + self._skipped, plan.poses)
        yield partial(self._move, self._home_rad)

    def _come_back(self) -> None:
        """The way of each joint begins where the arm stands."""
        if self._at_rad is not None:
            self._control.check()
            q_rad = self._bench.look(GLANCE_S).q_rad
            self._at_rad = np.where(np.abs(q_rad - self._at_rad) > DISPLACED_RAD, q_rad, self._at_rad)

    def _take(self, number: int, pose: PlannedPose) -> None:
        q_rad, way = np.array(pose.q_rad), np.array(pose.approach or np.zeros(len(pose.q_rad)))
        try:
            if np.any(way):
                with suppress(RefusedMotionError):  # at a limit or a box: it comes as it can, and `approach` says how
                    self._move(q_rad - self._options.opposite_rad * way)
            self._move(q_rad)
        except RefusedMotionError as why:
            return self._skip({"pose": number}, str(why))
        self._control.check()
        look = self._bench.look(self._options.dwell_s)
        self._control.check()
        if not np.isfinite(look.position_m).all():
            why = "the instrument gave no valid position: the target is hidden, or turned away from it"
            return self._skip({"pose": number}, why)
        self._keep(TrackedSample(look, self._approach.copy(), pose.repeat), {"pose": number})
        if len(self._samples) == SPREAD_FROM:
            self._check_spread()
        return None

    def _move(self, q_rad: Floats) -> None:
        self._control.move(self._bench.move, q_rad)
        if self._at_rad is not None:
            moved_rad = q_rad - self._at_rad
            self._approach = np.where(np.abs(moved_rad) > MOVED_RAD, np.sign(moved_rad), self._approach).astype(
                np.int64
            )
        self._at_rad = q_rad

    def _check_spread(self) -> None:
        """Distances between readings do not depend on where the instrument stands, only on its unit of length."""
        seen_m = np.array([sample.look.position_m for sample in self._samples])
        drawn_m = self._nominal_m(np.array([sample.look.q_rad for sample in self._samples]))
        seen, drawn = (float(np.sqrt(np.sum((each - each.mean(axis=0)) ** 2))) for each in (seen_m, drawn_m))
        if drawn >= LEAST_SPREAD_M and not SPREADS[0] <= seen / drawn <= SPREADS[1]:
            raise AcquisitionError(
                f"the readings spread over {seen:.3g} m, the target moved over {drawn:.3g} m: check length_unit and "
                "the columns of [devices.tracker], and whether the instrument follows the target of this arm"
            )
