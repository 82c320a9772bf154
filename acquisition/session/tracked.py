"""A session with a tracker: poses of a plan, each from its side, read once the target has settled.

Between two poses it may be paused; a pose that was broken off is taken again, from where the arm then stands.
"""

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError, RefusedMotionError
from acquisition.recording.pose_plan import PlannedPose, PosePlan
from acquisition.recording.samples import Cell
from acquisition.session.control import EndedEarlyError, RunControl, RunEvent
from acquisition.session.stepping import ELSEWHERE_RAD
from acquisition.wires.tracker_bench import TargetLook

Floats = NDArray[np.float64]
MOVED_RAD = 1e-6  # by which a joint counts as having moved
SPREAD_FROM = 4  # samples: from so many on, wrong units show in how far the readings spread
GLANCE_S = 0.05  # of a reading of where the arm stands after a pause
LEAST_SPREAD_M = 0.02  # of the nominal positions; less shows nothing about units
SPREADS = (0.5, 2.0)  # measured over nominal: arms are drawn to 1 %, units are wrong by 25 and more


class TargetBench(Protocol):
    """Move, look, stop."""

    def move(self, q_rad: Floats) -> None: ...

    def look(self, dwell_s: float) -> TargetLook: ...

    def stop(self) -> None: ...


@dataclass(frozen=True)
class TrackedSample:
    """A row of samples.csv in the making."""

    look: TargetLook
    approach: NDArray[np.int64]  # (joint,) -1, 0, +1: the way each joint last moved
    repeat: int | None

    def row(self) -> dict[str, Cell]:
        """Column name -> value; names of the session-folder format, version 1."""
        look = self.look
        x_m, y_m, z_m = look.position_m.tolist()
        row: dict[str, Cell] = {"t_s": look.t_s, **_numbered("q", "_rad", look.q_rad)}
        row |= {"x_m": x_m, "y_m": y_m, "z_m": z_m, **_numbered("cmd", "_rad", look.cmd_rad)}
        if look.encoder_rad is not None:
            row |= _numbered("enc", "_rad", look.encoder_rad)
        row |= {f"approach{i + 1}": int(sign) for i, sign in enumerate(self.approach)}
        row |= {"repeat": self.repeat, **_numbered("qd", "_rad_s", look.qd_rad_s), "settled": int(look.settled)}
        return row | {f"temp_{where}_degC": value for where, value in look.temperatures_degC.items()}


class TrackedJournal(Protocol):
    """The recording, or a test's list."""

    def sample(self, sample: TrackedSample) -> None: ...

    def event(self, kind: str, detail: Mapping[str, Any]) -> None: ...


@dataclass(frozen=True)
class TrackedOptions:
    """How every pose is taken."""

    dwell_s: float = 0.5
    opposite_rad: float = 0.035  # from how far a joint comes that has a side to come from


@dataclass(frozen=True)
class TrackedSummary:
    """What a session brought."""

    samples: tuple[TrackedSample, ...]
    skipped: int  # poses out of reach, or without a valid reading; why is in the journal


def check_tracked_plan(plan: PosePlan) -> None:
    """AcquisitionError where a session with a tracker cannot take a block as it is asked for."""
    for number, block in enumerate(plan.block, start=1):
        if block.placement is not None or block.seat is not None or block.payload_kg:
            raise AcquisitionError(
                f"block {number} of the plan names a placement, a seat or a payload: a session with a tracker changes "
                "nothing but the pose; take these poses by hand, or leave the block out"
            )


class TrackedSession:
    """Runs a plan; the only owner of what was taken. Stopping the arm after an error is the caller's.

    `nominal_m`: positions (pose, 3) of the target by the nominal arm, at joint readings (pose, joint), in the base.
    `control`: how a person pauses and ends it; None: nobody does. `done`: poses of the plan, from 1, that were taken
    before.
    """

    def __init__(
        self,
        bench: TargetBench,
        journal: TrackedJournal,
        options: TrackedOptions,
        home_rad: Floats,
        nominal_m: Callable[[Floats], Floats],
        *,
        tell: Callable[[int, int], None] = lambda done, total: None,
        control: RunControl | None = None,
        done: Collection[int] = (),
    ) -> None:
        self._bench, self._journal, self._options, self._tell = bench, journal, options, tell
        self._home_rad, self._nominal_m = home_rad, nominal_m
        self._at_rad: Floats | None = None
        self._approach = np.zeros(len(home_rad), dtype=np.int64)
        self._control, self._done = control or RunControl(bench.stop), frozenset(done)
        self._samples: list[TrackedSample] = []
        self._skipped = 0

    @property
    def taken(self) -> int:
        """Samples so far, also after the session was cut short."""
        return len(self._samples)

    def run(self, plan: PosePlan) -> TrackedSummary:
        """Home, every pose that is left, home. DeviceError, AcquisitionError, RecordingError end it.

        A person may end it sooner: that is no failure, and the arm stays where it is.
        """
        check_tracked_plan(plan)
        self._control.tell(RunEvent.START)
        try:
            self._step(lambda: self._move(self._home_rad))
            for number, pose in enumerate((pose for block in plan.block for pose in block.pose), start=1):
                if number not in self._done:
                    self._step(partial(self._take, number, pose))
                    self._tell(len(self._done) + len(self._samples) + self._skipped, plan.poses)
            self._step(lambda: self._move(self._home_rad))
        except EndedEarlyError:
            self._journal.event("ended by a person", {"samples": self.taken})
        self._control.finish()
        return TrackedSummary(tuple(self._samples), self._skipped)

    def _step(self, act: Callable[[], None]) -> None:
        """Done again where a pause broke it off. Raises what ends a session."""
        self._control.step(act, self._look_where_it_stands, lambda: None)

    def _look_where_it_stands(self) -> None:
        """A motion was broken off, or a person has moved the arm: the way of each joint begins there."""
        if self._at_rad is not None:
            self._control.check()
            q_rad = self._bench.look(GLANCE_S).q_rad
            self._at_rad = np.where(np.abs(q_rad - self._at_rad) > ELSEWHERE_RAD, q_rad, self._at_rad)

    def _take(self, number: int, pose: PlannedPose) -> None:
        q_rad, way = np.array(pose.q_rad), np.array(pose.approach or np.zeros(len(pose.q_rad)))
        try:
            if np.any(way):
                with suppress(RefusedMotionError):  # at a limit or a box: it comes as it can, and `approach` says how
                    self._move(q_rad - self._options.opposite_rad * way)
            self._move(q_rad)
        except RefusedMotionError as why:
            return self._skip(number, str(why))
        self._control.check()
        look = self._bench.look(self._options.dwell_s)
        self._control.check()
        if not np.isfinite(look.position_m).all():
            return self._skip(
                number, "the instrument gave no valid position: the target is hidden, or turned away from it"
            )
        sample = TrackedSample(look, self._approach.copy(), pose.repeat)
        self._samples.append(sample)
        self._journal.sample(sample)
        self._journal.event("sample", {"pose": number})
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

    def _skip(self, number: int, why: str) -> None:
        self._journal.event("skipped", {"pose": number, "why": why})
        self._skipped += 1


def _numbered(name: str, unit: str, values: Floats) -> dict[str, Cell]:
    return {f"{name}{i + 1}{unit}": float(value) for i, value in enumerate(values)}
