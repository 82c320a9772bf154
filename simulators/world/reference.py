"""The set-point between two commands: a straight line over one controller cycle, no faster than a joint can turn.

A controller commands once per cycle and its joints interpolate in between, so the reference trails the set-point by
one cycle and its speed is known to the servo. A jump becomes a ramp at top speed.
"""

import math

import numpy as np
from numpy.typing import NDArray

from simulators.wire import TICK_S
from simulators.world.model import STEP_S

Floats = NDArray[np.float64]
TOP_SPEED_RAD_S = math.pi  # 180 deg/s: UR5e technical details, every joint
STEPS_PER_COMMAND = round(TICK_S / STEP_S)


class Reference:
    """Where each joint shall be now, in the controller's own readings."""

    def __init__(self, q_rad: Floats) -> None:
        self.q_rad: Floats = q_rad.copy()
        self.qd_rad_s: Floats = np.zeros_like(q_rad)
        self.goal_rad: Floats = q_rad.copy()
        self.arrived = True
        self._stride_rad: Floats = np.zeros_like(q_rad)

    def aim(self, goal_rad: Floats) -> bool:
        """A new set-point (n,); False when it is the present one, which changes nothing."""
        if np.array_equal(goal_rad, self.goal_rad):
            return False
        self.goal_rad = goal_rad.copy()
        per_step_rad = np.abs(goal_rad - self.q_rad) / STEPS_PER_COMMAND
        self._stride_rad = np.minimum(per_step_rad, TOP_SPEED_RAD_S * STEP_S)
        self.arrived = False
        return True

    def step(self) -> None:
        """Advance by one physics step."""
        if self.arrived:
            return
        left_rad = self.goal_rad - self.q_rad
        move_rad = np.minimum(np.maximum(left_rad, -self._stride_rad), self._stride_rad)
        self.q_rad = self.q_rad + move_rad
        self.qd_rad_s = move_rad / STEP_S
        if not move_rad.any():
            self.q_rad = self.goal_rad.copy()
            self.arrived = True
