"""What a path is made of before it is planned: where to (T6 TOOL = COORD(s) POS), how, and how fast at most."""

import enum
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.kinematics import inverse

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Place:
    """`coord` None: fixed in the base."""

    name: str
    pos: Floats  # (4, 4) of the tool in its coordinates
    tool: Floats  # (4, 4) of the tool on the flange
    coord: Callable[[float], Floats] | None = None

    def coord_at(self, s_m: float) -> Floats:
        """COORD(s), (4, 4)."""
        return np.eye(4) if self.coord is None else self.coord(s_m)

    def flange_at(self, s_m: float) -> Floats:
        """T6 (4, 4) with the belt at s."""
        return self.coord_at(s_m) @ self.pos @ inverse(self.tool)


LARGEST_CHANGE = 2.0  # of speed at a corner: from full speed one way to full speed back
QUARTIC_PEAK = 0.75  # q'' = K (1 - h) 3h / tacc^2 is largest in the middle, with K = change of speed times tacc


class By(enum.Enum):
    """How a segment is driven."""

    JOINTS = "joint"
    LINE = "line"
    STAND = "stand"  # at the end of the segment before, in its coordinates


@dataclass(frozen=True, eq=False)
class Segment:
    """One MOVE, or a stand for GRASP, RELEASE and the end. `slower` stretches its time."""

    name: str
    by: By
    place: Place
    time_s: float = 0.0  # at least
    slower: float = 1.0
    action: str = ""  # done when the arm has come to rest in a stand
    posture_rad: Floats | None = None  # of a segment by joints: the very posture, where the place leaves a choice


@dataclass(frozen=True, eq=False)
class Pace:
    """The most that a path may ask of the arm; tacc is half the time of every transition."""

    speed_rad_s: Floats  # (joint,)
    acceleration_rad_s2: Floats  # (joint,)
    line_speed_m_s: float = 0.25  # ISO 10218-1, 5.6: reduced speed, where a person may be near
    line_turn_rad_s: float = 1.0  # of the tool on a straight line; feels right beside 0.25 m/s on a lever of 0.25 m

    @property
    def tacc_s(self) -> float:
        """So long that a joint may turn back at full speed within its acceleration."""
        shares = QUARTIC_PEAK * LARGEST_CHANGE * self.speed_rad_s / self.acceleration_rad_s2
        return float(np.max(shares))
