"""Moves with an end: joint space (movej), straight tool line (movel) and a chain of both (a path).

They start from rest. What is not imitated: blends (the arm halts at every way-point), and the time law of a
real controller, which also limits jerk.

Also the set-point, what every generator of set-points offers, and the trapezoidal time law that moves follow.
Source: Siciliano et al., "Robotics: Modelling, Planning and Control", section 4.2.1; the names `speed` and
`acceleration` are those of URScript's movej and movel (leading axis, tool).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.ur.controller_kinematics import NominalArm
from simulators.ur.poses import Frame, partway, twist_to

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SetPoint:
    """Where the joints shall be, in the controller's own readings; each (n,)."""

    q_rad: Floats
    qd_rad_s: Floats
    qdd_rad_s2: Floats


class Generator(Protocol):
    """One motion. `finished` says that the last set-point was its end; it then stands still."""

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


class JointMove:
    """All joints start and end together; the one with the longest way keeps to speed and acceleration."""

    def __init__(self, start_rad: Floats, end_rad: Floats, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        way_rad = end_rad - start_rad
        longest_rad = float(np.abs(way_rad).max())
        self._law = trapezoid(longest_rad, speed_rad_s, acceleration_rad_s2)
        self._start_rad, self._end_rad = start_rad, end_rad
        self._direction = way_rad / longest_rad if longest_rad > 0.0 else way_rad
        self._t_s = 0.0

    @property
    def finished(self) -> bool:
        return self._t_s >= self._law.duration_s

    def step(self, now: SetPoint, dt_s: float) -> SetPoint:
        self._t_s += dt_s
        if self.finished:
            return standing(self._end_rad)
        way, speed, acceleration = self._law.at(self._t_s)
        return SetPoint(
            self._start_rad + way * self._direction, speed * self._direction, acceleration * self._direction
        )


class LineMove:
    """The tool point on a straight line, orientation by slerp, both under one time law."""

    def __init__(
        self, arm: NominalArm, T_flange_tool: Frame, start_rad: Floats, T_base_end: Frame, speed_m_s: float,
        acceleration_m_s2: float,
    ) -> None:  # fmt: skip
        self._arm, self._T_flange_tool = arm, T_flange_tool
        self._start = arm.tool(start_rad.tolist(), T_flange_tool)
        self._twist = twist_to(self._start, T_base_end)
        self._law = _slower_law(self._twist, speed_m_s, acceleration_m_s2)
        self._t_s = 0.0

    @property
    def finished(self) -> bool:
        return self._t_s >= self._law.duration_s

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
