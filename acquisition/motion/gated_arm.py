"""A controller behind the gate for motions that it makes itself, from one posture to the next by joints.

Sessions move this way: the controller interpolates, so the way is known, and is gone through before it is let go.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RefusedMotionError
from acquisition.motion.cell import Cell, body_points, entered
from acquisition.motion.kinematics import Kinematics
from drivers.device import Movable

Floats = NDArray[np.float64]

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
