"""Motions without an end: the set-point follows what the program streams (servoj, speedj, speedl), or comes to rest.

What is not imitated: the real servoj filter is not published. Here the set-point approaches the target with the time
constant lookahead * 300 / gain (300 is URScript's default gain), within the joint limits: it lags, and does not
overshoot.
"""

import math
from collections.abc import Sequence

import numpy as np

from simulators.ur.controller_kinematics import NominalArm
from simulators.ur.moves import Floats, PathBlocked, SetPoint, follow, standing
from simulators.ur.poses import Frame

DEFAULT_GAIN = 300.0  # URScript manual, servoj
NEAR_RAD = 1e-9  # closer than any encoder resolves: take the target itself, so that the arm comes to rest on it
SINGULAR = (
    1e-6  # |det J| below which a tool speed asks for joint speeds beyond any limit (m^3, feels right for arms of 1 m)
)


class JointServo:
    """servoj: `aim` again and again; ends only when another motion takes its place."""

    finished = False

    def __init__(self, speed_limit_rad_s: float, acceleration_limit_rad_s2: float) -> None:
        self._speed_limit_rad_s = speed_limit_rad_s
        self._acceleration_limit_rad_s2 = acceleration_limit_rad_s2
        self._target_rad: Floats | None = None
        self._rate_per_s = 0.0

    def aim(self, target_rad: Floats, lookahead_s: float, gain: float) -> None:
        """Lookahead 0.03..0.2 s and gain 100..2000, the ranges of URScript; outside they are moved to the edge."""
        lookahead_s, gain = min(max(lookahead_s, 0.03), 0.2), min(max(gain, 100.0), 2000.0)
        self._target_rad = target_rad
        self._rate_per_s = gain / DEFAULT_GAIN / lookahead_s

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        if self._target_rad is None:
            return standing(now.q_rad)
        error_rad = self._target_rad - now.q_rad
        if np.abs(error_rad).max() < NEAR_RAD:
            return standing(self._target_rad)
        a = self._acceleration_limit_rad_s2
        # from this distance the joint brakes in time with half of what it can; the rest makes up for whole cycles
        most = np.minimum(self._speed_limit_rad_s, np.sqrt(a * np.abs(error_rad)))
        wanted = np.clip(error_rad * min(self._rate_per_s, 0.5 / dt_s), -most, most)
        qd_rad_s = now.qd_rad_s + np.clip(wanted - now.qd_rad_s, -a * dt_s, a * dt_s)
        return follow(now, now.q_rad + qd_rad_s * dt_s, dt_s)


class JointSpeed:
    """speedj: the joint speed vector approaches the wanted one at `acceleration` of the leading axis."""

    def __init__(self, qd_rad_s: Floats, acceleration_rad_s2: float, time_s: float = math.inf) -> None:
        self._wanted_rad_s, self._acceleration_rad_s2, self._left_s = qd_rad_s, acceleration_rad_s2, time_s

    @property
    def finished(self) -> bool:
        return self._left_s <= 0.0

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        self._left_s -= dt_s
        qd_rad_s = ramp(now.qd_rad_s, self._wanted_rad_s, self._acceleration_rad_s2 * dt_s)
        return SetPoint(now.q_rad + qd_rad_s * dt_s, qd_rad_s, (qd_rad_s - now.qd_rad_s) / dt_s)


class JointStop:
    """stopj: all joints to rest together, the fastest one at `deceleration`."""

    def __init__(self, deceleration_rad_s2: float) -> None:
        self._deceleration_rad_s2 = deceleration_rad_s2
        self._stands = False

    @property
    def finished(self) -> bool:
        return self._stands

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        qd_rad_s = ramp(now.qd_rad_s, np.zeros(len(now.q_rad)), self._deceleration_rad_s2 * dt_s)
        self._stands = not qd_rad_s.any()
        return SetPoint(now.q_rad + qd_rad_s * dt_s, qd_rad_s, (qd_rad_s - now.qd_rad_s) / dt_s)


class ToolSpeed:
    """speedl, and stopl when the wanted speed is zero: tool speed [m/s, rad/s] in the base frame, ramped."""

    def __init__(self, arm: NominalArm, T_flange_tool: Frame, speed: Sequence[float], acceleration_m_s2: float) -> None:
        self._arm, self._T_flange_tool = arm, T_flange_tool
        self._wanted, self._acceleration = np.array(speed), acceleration_m_s2
        self._speed: Floats | None = None
        self._ends = not self._wanted.any()

    @property
    def finished(self) -> bool:
        return self._ends and self._speed is not None and not self._speed.any()

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        J, _ = self._arm.jacobian(now.q_rad.tolist(), self._T_flange_tool)
        if self._speed is None:
            self._speed = J @ now.qd_rad_s
        self._speed = ramp(self._speed, self._wanted, self._acceleration * dt_s)
        if not self._speed.any():
            return standing(now.q_rad)
        if abs(float(np.linalg.det(J))) < SINGULAR:
            raise PathBlocked("the tool speed cannot be followed at this singular arm position")
        return follow(now, now.q_rad + np.linalg.solve(J, self._speed) * dt_s, dt_s)


def ramp(speed: Floats, wanted: Floats, step: float) -> Floats:
    """`speed` brought towards `wanted` in a straight line, its largest component by at most `step`."""
    missing = wanted - speed
    largest = float(np.abs(missing).max())
    return wanted.copy() if largest <= step else speed + missing * (step / largest)
