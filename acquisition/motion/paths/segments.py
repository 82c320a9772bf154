"""What a path is made of before it is planned: where to (T6 TOOL = COORD(s) POS), how, how fast at most; and the
transition about a corner, which takes position, speed and acceleration of the segment before over into the next.

Between two straight segments through one corner the transition is the quartic of the source,
q = [(dC tacc/T + dB)(2 - h) h^2 - 2 dB] h + B + dB (R. Paul, Robot Manipulators, 1981, ch. 5.6): six conditions fix a
fifth degree, whose last coefficient is then zero. Curved segments (joint to straight line, a belt, two turns at once)
meet without a jump, too, which the quartic alone does not give. docs/decisions/0012.
"""

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
    CURVE = "curve"  # readings over time, as given
    STAND = "stand"  # at the end of the segment before, in its coordinates


@dataclass(frozen=True, eq=False)
class Curve:
    """Readings over time, at rest at both ends and without acceleration there."""

    at: Callable[[float], Floats]  # (joint,) from 0 to length_s
    length_s: float


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
    curve: Curve | None = None  # of By.CURVE; the segment before ends where it begins


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


# Fifth degree in h = 0..1 by value, slope and curvature at both ends: rows h^0 ... h^5.
_HERMITE = np.linalg.inv(
    np.array(
        [
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 2.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            [0.0, 0.0, 2.0, 6.0, 12.0, 20.0],
        ]
    )
)
PROBE_S = 5e-3  # between the samples that slopes are read off: error of fourth order, rounding 1e-13 / PROBE_S^2


@dataclass(frozen=True, eq=False)
class BlendState:
    """Position, speed and acceleration (n,) at one moment, in whatever coordinates the blend is made in."""

    position: Floats
    speed: Floats
    acceleration: Floats


@dataclass(frozen=True, eq=False)
class Blend:
    """From `begin_s` to `end_s`."""

    begin_s: float
    end_s: float
    coefficients: Floats  # (6, n) of powers of h

    def at(self, t_s: float) -> Floats:
        """(n,) h runs from 0 to 1."""
        h = (t_s - self.begin_s) / (self.end_s - self.begin_s)
        return np.power(h, np.arange(6)) @ self.coefficients


def blend(begin_s: float, begin: BlendState, end_s: float, end: BlendState) -> Blend:
    """The blend that meets both states."""
    span = end_s - begin_s
    rows = [begin.position, begin.speed * span, begin.acceleration * span**2]
    rows += [end.position, end.speed * span, end.acceleration * span**2]
    return Blend(begin_s, end_s, _HERMITE @ np.stack(rows))


def state_of(curve: Callable[[float], Floats], t_s: float) -> BlendState:
    """Position, speed and acceleration of a smooth curve, by differences of fourth order."""
    a, b, c, d, e = (curve(t_s + k * PROBE_S) for k in (-2, -1, 0, 1, 2))
    speed = (a - 8.0 * b + 8.0 * d - e) / (12.0 * PROBE_S)
    acceleration = (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / (12.0 * PROBE_S**2)
    return BlendState(c, speed, acceleration)
