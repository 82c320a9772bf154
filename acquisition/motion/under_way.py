"""What every set-point has to keep while the arm moves: joint range, joint speed, keep-out boxes, slow areas.

A plan promises these for what was expected. A belt may run otherwise, and a brake by joints leaves the path. Sessions
move from one posture to the next by joints: the controller interpolates, so the way is known, and `GatedArm` goes
through it before it is let go.
"""

import math
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.cell import Cell, body_of, body_points, entered, nearest_m
from acquisition.motion.kinematics import Kinematics
from acquisition.motion.paths.segments import Pace
from acquisition.motion.plan import SAMPLE_S
from drivers.device import Movable

Floats = NDArray[np.float64]

# Of a speed, over WINDOW_S of the host's time: plans are let go at 1.02. A belt is read some ms early or late, and
# after a missed cycle it has gone further than a period's worth; over so long that is a tenth of its speed.
OVER = 1.2
WINDOW_S = 0.05
JUMP = 2.0  # of a speed, from one set-point to the next
BETWEEN_M = 1e-3  # what a path that is clear at samples 20 ms apart may come nearer between them, at 1 m and 1 rad/s


class UnderWay:
    """The one owner of what was sent last. The first set-point is where the arm stands; then one every `period_s`."""

    def __init__(self, arm: Kinematics, pace: Pace, cell: Cell, start_rad: Floats, period_s: float) -> None:
        self._arm, self._pace, self._cell, self._period_s = arm, pace, cell, period_s
        self._edge_rad = pace.acceleration_rad_s2 * SAMPLE_S**2 / 8.0  # of a way back between two samples of a plan
        frames = arm.frames(start_rad[None])
        self._body = body_of(frames[0], cell.tool_m, cell.com_m)
        self._tip = body_of(frames[0, -3:], cell.tool_m)  # wrist, flange and tool
        self._sent = deque([(-np.inf, start_rad, self._tip.at(frames[:, -3:])[0])])  # when, joints, points of the tool
        # No box may be nearer than this, or than the clearance.
        self._near_m = nearest_m(cell.keep_out, self._body.at(frames)[0]) if cell.keep_out else np.empty(0)

    def check(self, q_rad: Floats, t_s: float) -> None:
        """The next set-point (joint,), about to be sent. InterruptedMotionError states what is wrong."""
        while len(self._sent) > 1 and self._sent[1][0] <= t_s - WINDOW_S:
            self._sent.popleft()
        self._check_range(q_rad)
        self._check_speed(q_rad, t_s)
        tool_m = self._sent[-1][2]
        if self._cell.keep_out or self._cell.slow:
            frames = self._arm.frames(q_rad[None])
            tool_m = self._tip.at(frames[:, -3:])[0]
            if self._cell.keep_out:
                self._check_boxes(frames)
            self._check_areas(tool_m, t_s)
        self._sent.append((t_s, q_rad, tool_m))

    def _since(self, t_s: float) -> float:
        """Time since the oldest that is remembered; a stream that catches up after a missed cycle counts as in time."""
        planned_s = len(self._sent) * self._period_s
        begun_s = self._sent[0][0]
        return planned_s if begun_s == -np.inf else max(planned_s, t_s - begun_s)

    def _check_range(self, q_rad: Floats) -> None:
        arm = self._arm
        outside = (q_rad < arm.lower_rad - self._edge_rad) | (q_rad > arm.upper_rad + self._edge_rad)
        if outside.any():
            joint = int(np.argmax(outside))
            raise _stopped(
                f"joint {joint + 1} at {np.degrees(q_rad[joint]):.1f}° would leave its range "
                f"{np.degrees(arm.lower_rad[joint]):.1f} to {np.degrees(arm.upper_rad[joint]):.1f}°"
            )

    def _check_speed(self, q_rad: Floats, t_s: float) -> None:
        for before_rad, time_s, most in (
            (self._sent[0][1], self._since(t_s), OVER),
            (self._sent[-1][1], self._period_s, JUMP),
        ):
            share = np.abs(q_rad - before_rad) / (time_s * self._pace.speed_rad_s)
            if np.max(share) > most:
                joint = int(np.argmax(share))
                raise _stopped(f"joint {joint + 1} would run at {np.max(share):.2f} of its speed")

    def _check_boxes(self, frames: Floats) -> None:
        near_m = nearest_m(self._cell.keep_out, self._body.at(frames)[0])
        floor_m = np.minimum(self._near_m, self._cell.clearance_m)
        entered = np.flatnonzero(near_m < floor_m - BETWEEN_M)
        if entered.size:
            box = self._cell.keep_out[int(entered[0])]
            raise _stopped(
                f"the middle of a link, or the tool, would come within {1e3 * max(0.0, near_m[entered[0]]):.0f} mm of "
                f"the keep-out box '{box.name}' (clearance {1e3 * self._cell.clearance_m:.0f} mm)"
            )
        self._near_m = np.maximum(self._near_m, near_m)

    def _check_areas(self, tool_m: Floats, t_s: float) -> None:
        speed_m_s = np.linalg.norm(tool_m - self._sent[0][2], axis=1) / self._since(t_s)
        for area in self._cell.slow:
            fastest_m_s = np.max(np.where(area.box.distance_m(tool_m) <= 0.0, speed_m_s, 0.0))
            if fastest_m_s > OVER * area.speed_m_s:
                raise _stopped(
                    f"the tool would make {fastest_m_s:.2f} m/s in the area '{area.box.name}' (limit "
                    f"{area.speed_m_s:.2f} m/s)"
                )


def _stopped(why: str) -> InterruptedMotionError:
    return InterruptedMotionError(f"{why}; the arm was stopped: its belt or its plan is not as it was expected")


STEP_RAD = 0.02  # of the joint with the longest way, between the postures that are looked at: 2 cm at 1 m
EDGE_RAD = 1e-9  # rounding of a target on the joint limit itself


class GatedArm:
    """A `Movable`. `now` gives the readings (joint,) of the arm, which stands when a motion begins."""

    def __init__(self, arm: Movable, kinematics: Kinematics, cell: Cell, now: Callable[[], Floats]) -> None:
        self.name = arm.name
        self._arm, self._kinematics, self._cell, self._now = arm, kinematics, cell, now
        self._under_way: tuple[Floats, float, float] | None = None  # target, speed, acceleration

    def connect(self) -> None:
        self._arm.connect()

    def move_joints(self, q_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """As of the arm; slower where the tool passes a slow area. RefusedMotionError before anything moves."""
        self._check_range(q_rad)
        start_rad = self._now()
        way_rad = float(np.max(np.abs(q_rad - start_rad)))
        shares = np.linspace(0.0, 1.0, int(way_rad / STEP_RAD) + 2)[:, None]
        frames = self._kinematics.frames(start_rad + shares * (q_rad - start_rad))
        self._check_boxes(frames)
        share = 1.0 if way_rad == 0.0 else self._speed_share(frames, shares[:, 0] * way_rad, speed_rad_s)
        self._under_way = q_rad, share * speed_rad_s, acceleration_rad_s2
        try:
            self._arm.move_joints(q_rad, share * speed_rad_s, acceleration_rad_s2)
        finally:
            self._under_way = None

    def rests_in_s(self) -> float:
        """Device time (s) until the motion under way ends, at most, at full speed slider; 0: none is under way."""
        under_way = self._under_way
        if under_way is None:
            return 0.0
        target_rad, speed_rad_s, acceleration_rad_s2 = under_way
        way_rad = float(np.max(np.abs(target_rad - self._now())))
        if way_rad < speed_rad_s**2 / acceleration_rad_s2:  # too short to reach the speed
            return 2.0 * math.sqrt(way_rad / acceleration_rad_s2)
        return way_rad / speed_rad_s + speed_rad_s / acceleration_rad_s2

    def stop(self, deceleration_rad_s2: float | None = None) -> None:
        if deceleration_rad_s2 is None:
            self._arm.stop()
        else:
            self._arm.stop(deceleration_rad_s2)

    def hold(self) -> None:
        self._arm.hold()

    def close(self) -> None:
        self._arm.close()

    def _check_range(self, q_rad: Floats) -> None:
        arm = self._kinematics
        outside = (q_rad < arm.lower_rad - EDGE_RAD) | (q_rad > arm.upper_rad + EDGE_RAD)
        if outside.any():
            joint = int(np.argmax(outside))
            raise RefusedMotionError(
                f"joint {joint + 1} at {np.degrees(q_rad[joint]):.1f}° would leave its range "
                f"{np.degrees(arm.lower_rad[joint]):.1f} to {np.degrees(arm.upper_rad[joint]):.1f}°"
            )

    def _check_boxes(self, frames: Floats) -> None:
        points = body_points(frames, self._cell.tool_m, self._cell.com_m)
        for box in self._cell.keep_out:
            if (hit := entered(box, points, self._cell.clearance_m)) is not None:
                raise RefusedMotionError(
                    f"the middle of a link, or the tool, would come within {1e3 * hit[1]:.0f} mm of the keep-out box "
                    f"'{box.name}' (clearance {1e3 * self._cell.clearance_m:.0f} mm) on its way; choose another pose, "
                    "or correct the box"
                )

    def _speed_share(self, frames: Floats, way_rad: Floats, speed_rad_s: float) -> float:
        """What of the speed the slow areas leave, if the joint with the longest way runs at `speed_rad_s`."""
        share = 1.0
        points = body_points(frames[:, -3:], self._cell.tool_m)
        speed_m_s = speed_rad_s * np.linalg.norm(np.gradient(points, way_rad, axis=0), axis=2)
        for area in self._cell.slow:
            inside = area.box.distance_m(points) <= 0.0
            fastest_m_s = float(np.max(np.where(inside, speed_m_s, 0.0)))
            share = min(share, area.speed_m_s / fastest_m_s) if fastest_m_s > 0.0 else share
        return share
