"""Motions of the controller: those with an end (movej, movel, a path of both), and those that follow a stream.

Moves start from rest and follow a trapezoidal time law. What is not imitated: blends (the arm halts at every
way-point), and the time law of a real controller, which also limits jerk. Source: Siciliano et al., "Robotics:
Modelling, Planning and Control", section 4.2.1; the names `speed` and `acceleration` are those of URScript's movej and
movel (leading axis, tool).

Streams: the set-point follows what the program sends (servoj, speedj, speedl), or comes to rest. What is not imitated:
the real servoj filter is not published. Here the set-point approaches the target with the time constant lookahead * 300
/ gain (300 is URScript's default gain), within the joint limits: it lags, and does not overshoot.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.ur.controller_kinematics import Frame, NominalArm, partway, twist_to

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SetPoint:
    """Where the joints shall be, in the controller's own readings; each (n,)."""

    q_rad: Floats
    qd_rad_s: Floats
    qdd_rad_s2: Floats


class Generator(Protocol):
    """One motion. `finished`: the last set-point was its end; it then stands still."""

    @property
    def finished(self) -> bool: ...

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        """The next set-point. PathBlocked when the arm cannot follow."""
        ...


class PathBlocked(Exception):  # noqa: N818 - the arm is blocked, the program is not in error
    """The path leaves what the joints can do: joint range, joint speed near a singularity, out of reach."""


def standing(q_rad: Floats) -> SetPoint:
    """A set-point at rest."""
    return SetPoint(q_rad, np.zeros(len(q_rad)), np.zeros(len(q_rad)))


@dataclass(frozen=True)
class Trapezoid:
    """From rest to rest over `distance` >= 0, in any unit u; u/s and u/s^2 are limits and stay under them."""

    distance: float
    acceleration: float
    ramp_s: float
    cruise_s: float

    @property
    def duration_s(self) -> float:
        return 2.0 * self.ramp_s + self.cruise_s

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Way, speed and acceleration at a time; still before the start and after the end."""
        if t_s >= self.duration_s:  # asked first: the shortest ways take no time at all
            return self.distance, 0.0, 0.0
        if t_s <= 0.0:
            return 0.0, 0.0, 0.0
        a, ramp = self.acceleration, self.ramp_s
        if t_s < ramp:
            return 0.5 * a * t_s * t_s, a * t_s, a
        if t_s <= ramp + self.cruise_s:
            return a * ramp * (t_s - 0.5 * ramp), a * ramp, 0.0
        left = self.duration_s - t_s
        return self.distance - 0.5 * a * left * left, a * left, -a


def trapezoid(distance: float, speed: float, acceleration: float) -> Trapezoid:
    """The fastest one within both limits. ValueError unless both are positive and the distance is not negative."""
    if not (distance >= 0.0 and speed > 0.0 and acceleration > 0.0):
        raise ValueError(
            f"move over {distance} at speed {speed} and acceleration {acceleration}; both must be positive"
        )
    ramp_s = min(speed / acceleration, (distance / acceleration) ** 0.5)
    cruise_s = max(0.0, distance / (acceleration * ramp_s) - ramp_s) if ramp_s > 0.0 else 0.0
    return Trapezoid(distance, acceleration, ramp_s, cruise_s)


TURN_SPEED_RAD_S = 1.05  # movel of a pure turn: the controller's default joint speed and acceleration (URScript, movej)
TURN_ACCELERATION_RAD_S2 = 1.4


Leg = Callable[[Floats], Generator]  # makes the motion of one leg from the joint readings (n,) where it begins


class TimedMove:
    """A move from rest to rest under one time law."""

    def __init__(self, law: Trapezoid) -> None:
        self._law, self._t_s = law, 0.0

    @property
    def finished(self) -> bool:
        return self._t_s >= self._law.duration_s


class JointMove(TimedMove):
    """All joints start and end together; the one with the longest way keeps to speed and acceleration."""

    def __init__(self, start_rad: Floats, end_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        way_rad = end_rad - start_rad
        longest_rad = float(np.abs(way_rad).max())
        super().__init__(trapezoid(longest_rad, speed_rad_s, acceleration_rad_s2))
        self._start_rad, self._end_rad = start_rad, end_rad
        self._direction = way_rad / longest_rad if longest_rad > 0.0 else way_rad

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        self._t_s += dt_s
        if self.finished:
            return standing(self._end_rad)
        way, speed, acceleration = self._law.at(self._t_s)
        return SetPoint(
            self._start_rad + way * self._direction, speed * self._direction, acceleration * self._direction
        )


class LineMove(TimedMove):
    """The tool point on a straight line, orientation by slerp, both under one time law."""

    def __init__(
        self, arm: NominalArm, T_flange_tool: Frame, start_rad: Floats, T_base_end: Frame, speed_m_s: float,
        acceleration_m_s2: float,
    ) -> None:  # fmt: skip
        self._arm, self._T_flange_tool = arm, T_flange_tool
        self._start = arm.tool(start_rad.tolist(), T_flange_tool)
        self._twist = twist_to(self._start, T_base_end)
        super().__init__(_slower_law(self._twist, speed_m_s, acceleration_m_s2))

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        self._t_s += dt_s
        way = self._law.at(self._t_s)[0]
        fraction = way / self._law.distance if self._law.distance > 0.0 else 1.0
        target = partway(self._start, self._twist, fraction)
        q_rad = self._arm.inverse(target, now.q_rad.tolist(), self._T_flange_tool)
        if q_rad is None:
            raise PathBlocked("the straight line leaves the arm's reach or crosses a singularity")
        if self.finished:
            return standing(q_rad)
        return follow(now, q_rad, dt_s)


class PathMove:
    """Several moves one after the other; each is made when its turn comes, from where the arm then is."""

    def __init__(self, legs: Sequence[Leg], first: Generator | None = None) -> None:
        """`first`: what brings the arm to rest before, and counts as no leg."""
        self._legs, self._current = list(legs), first
        self.leg = -1  # index of the present leg: what signal_async_progress reports

    @property
    def finished(self) -> bool:
        return not self._legs and (self._current is None or self._current.finished)

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        if self._current is None or self._current.finished:
            if not self._legs:
                return standing(now.q_rad)
            self._current = self._legs.pop(0)(now.q_rad)
            self.leg += 1
        return self._current.step(now, dt_s)


def follow(now: SetPoint, q_rad: Floats, dt_s: float) -> SetPoint:
    """The set-point at `q_rad`, its speed and acceleration from the one before."""
    qd_rad_s = (q_rad - now.q_rad) / dt_s
    return SetPoint(q_rad, qd_rad_s, (qd_rad_s - now.qd_rad_s) / dt_s)


def _slower_law(twist: Sequence[float], speed_m_s: float, acceleration_m_s2: float) -> Trapezoid:
    shift = trapezoid(float(np.linalg.norm(twist[:3])), speed_m_s, acceleration_m_s2)
    turn = trapezoid(float(np.linalg.norm(twist[3:])), TURN_SPEED_RAD_S, TURN_ACCELERATION_RAD_S2)
    return shift if shift.duration_s >= turn.duration_s else turn


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
