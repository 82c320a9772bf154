"""The straight parts of a path, each in coordinates of its own: joints, or the tool in fixed or moving coordinates.

A leg is a curve of points over time that knows nothing of the belt; the belt enters where a point becomes joints. So
a leg goes on along a belt that is faster, slower or stands still, without being planned again.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.inverse.solver import Solver
from acquisition.motion.paths.drive import Drive
from acquisition.motion.rigid import inverse, rotation_vector, transform
from acquisition.motion.task.place import Place

Floats = NDArray[np.float64]


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
