"""The straight parts of a path, each in coordinates of its own: joints, or the tool in fixed or moving coordinates.

A leg is a curve of points over time that knows nothing of the belt; the belt enters where a point becomes joints. So
a leg goes on along a belt that is faster, slower or stands still, without being planned again.

The drive transform D(r) = T(r) Ra(r) Ro(r) goes straight from one pose to another, turning about two axes at once: the
approach vector turns by r theta about k = (-sin psi, cos psi, 0), and the tool by r phi about the approach vector.
Source: R. Paul, Robot Manipulators, 1981, ch. 5.7; lecture chapter 8, "Cartesian motion".
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import inverse, rotation_vector, transform
from acquisition.motion.paths.segments import Curve, Place

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Drive:
    """From P1 (r = 0) to P2 (r = 1), in the coordinates of P1."""

    shift_m: Floats  # (3,) x, y, z
    psi_rad: float
    theta_rad: float  # 0 to pi
    phi_rad: float

    def at(self, r: float) -> Floats:
        """D(r), (4, 4); beyond 0 and 1 it goes straight on."""
        T = np.eye(4)
        T[:3, :3] = _tilt(self.psi_rad, r * self.theta_rad) @ _spin(r * self.phi_rad)
        T[:3, 3] = r * self.shift_m
        return T


def drive_between(P1: Floats, P2: Floats) -> Drive:
    """The drive that leads from P1 to P2, both (4, 4) in the same coordinates."""
    n1, o1, a1, p1 = (P1[:3, i] for i in range(4))
    n2, o2, a2, p2 = (P2[:3, i] for i in range(4))
    shift = p2 - p1
    along_n, along_o = float(n1 @ a2), float(o1 @ a2)
    psi = math.atan2(along_o, along_n)
    theta = math.atan2(math.hypot(along_n, along_o), float(a1 @ a2))
    s, c, v = math.sin(psi), math.cos(psi), 1.0 - math.cos(theta)
    second = np.array([-s * c * v, c * c * v + math.cos(theta), -s * math.sin(theta)])  # y of P1 after the tilt
    sine = second @ np.array([n1 @ n2, o1 @ n2, a1 @ n2])
    cosine = second @ np.array([n1 @ o2, o1 @ o2, a1 @ o2])
    shift_m = np.array([n1 @ shift, o1 @ shift, a1 @ shift])
    return Drive(shift_m, psi, theta, math.atan2(float(sine), float(cosine)))


def _tilt(psi_rad: float, theta_rad: float) -> Floats:
    """(3, 3) turn by theta about (-sin psi, cos psi, 0)."""
    s, c = math.sin(psi_rad), math.cos(psi_rad)
    st, ct = math.sin(theta_rad), math.cos(theta_rad)
    v = 1.0 - ct
    return np.array(
        [
            [s * s * v + ct, -s * c * v, c * st],
            [-s * c * v, c * c * v + ct, s * st],
            [-c * st, -s * st, ct],
        ]
    )


def _spin(phi_rad: float) -> Floats:
    """(3, 3) turn about z."""
    s, c = math.sin(phi_rad), math.cos(phi_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class Leg(Protocol):
    """Points are joints (n,) or poses (4, 4); `flat` makes vectors of those near the corner where the leg begins."""

    @property
    def duration_s(self) -> float: ...

    def point(self, t_s: float) -> Floats:
        """Where the leg is, t after the corner; it may be asked a little beyond both ends."""
        ...

    def flat(self, point: Floats) -> Floats: ...

    def unflat(self, vector: Floats) -> Floats: ...

    def from_joints(self, q_rad: Floats, s_m: float) -> Floats:
        """The point of this leg's coordinates at which the arm stands."""
        ...

    def joints(self, point: Floats, s_m: float, near_rad: Floats) -> Floats:
        """Joint readings (joint,) at a point. UnreachableError."""
        ...


@dataclass(frozen=True, eq=False)
class JointLeg:
    """All joints in proportion. With a moving target the way is corrected by (JC2 - JC1)(s - s1)/(s2 - s1)."""

    start_rad: Floats
    end_rad: Floats  # JC1, with the belt at s1
    duration_s: float
    per_m: Floats  # (JC2 - JC1)/(s2 - s1), zero for a target that stands
    s1_m: float = 0.0

    def point(self, t_s: float) -> Floats:
        return self.start_rad + (self.end_rad - self.start_rad) * (t_s / self.duration_s)

    def flat(self, point: Floats) -> Floats:
        return point

    def unflat(self, vector: Floats) -> Floats:
        return vector

    def from_joints(self, q_rad: Floats, s_m: float) -> Floats:
        return q_rad - self.per_m * (s_m - self.s1_m)

    def joints(self, point: Floats, s_m: float, near_rad: Floats) -> Floats:
        return point + self.per_m * (s_m - self.s1_m)


@dataclass(frozen=True, eq=False)
class CurveLeg:
    """Readings over time. The arm stands for `stand_s` before and after, in which the transitions have their place."""

    curve: Curve
    stand_s: float
    slower: float = 1.0

    @property
    def duration_s(self) -> float:
        return 2.0 * self.stand_s + self.slower * self.curve.length_s

    def point(self, t_s: float) -> Floats:
        return self.curve.at(min(max((t_s - self.stand_s) / self.slower, 0.0), self.curve.length_s))

    def flat(self, point: Floats) -> Floats:
        return point

    def unflat(self, vector: Floats) -> Floats:
        return vector

    def from_joints(self, q_rad: Floats, s_m: float) -> Floats:
        return q_rad

    def joints(self, point: Floats, s_m: float, near_rad: Floats) -> Floats:
        return point


@dataclass(frozen=True, eq=False)
class LineLeg:
    """T6 = COORD2(s) 2POS1 D(r) TOOL2^-1."""

    solver: Solver
    place: Place
    start: Floats  # 2POS1
    drive: Drive
    duration_s: float

    def point(self, t_s: float) -> Floats:
        return self.start @ self.drive.at(t_s / self.duration_s)

    def flat(self, point: Floats) -> Floats:
        turn = rotation_vector(self.start[:3, :3].T @ point[:3, :3])
        return np.concatenate([point[:3, 3], turn])

    def unflat(self, vector: Floats) -> Floats:
        T = transform(vector[:3], vector[3:])
        T[:3, :3] = self.start[:3, :3] @ T[:3, :3]
        return T

    def from_joints(self, q_rad: Floats, s_m: float) -> Floats:
        return inverse(self.place.coord_at(s_m)) @ self.solver.flange(q_rad) @ self.place.tool

    def joints(self, point: Floats, s_m: float, near_rad: Floats) -> Floats:
        return self.solver.kept(self.place.coord_at(s_m) @ point @ inverse(self.place.tool), near_rad)
