"""What the cell allows: boxes that nothing may enter, areas in which the tool is slow, and how near is too near.

Boxes lie along the axes of the robot's base.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ROUNDING_M = 1e-6  # of a distance that stays the same
LINK_POINTS = 8  # on every link, for its distance to a box: 5 cm apart on the longest link of a small arm


@dataclass(frozen=True)
class Box:
    """A named box (m, base frame)."""

    name: str
    lower_m: tuple[float, float, float]
    upper_m: tuple[float, float, float]

    def distance_m(self, points_m: Floats) -> Floats:
        """(...) from points (..., 3) to the box; inside it the depth, negative."""
        beyond = np.maximum(np.array(self.lower_m) - points_m, points_m - np.array(self.upper_m))
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
        return np.asarray(outside + np.minimum(np.max(beyond, axis=-1), 0.0))


@dataclass(frozen=True)
class SlowArea:
    """A box in which no point of the tool may be faster."""

    box: Box
    speed_m_s: float


@dataclass(frozen=True)
class Cell:
    """Everything about the cell. `clearance_m`: half the thickness of the arm's links and what hangs on them."""

    keep_out: Sequence[Box] = ()
    slow: Sequence[SlowArea] = ()
    clearance_m: float = 0.06  # half of the 120 mm that a UR5e's elbow is wide
    tool_m: Sequence[tuple[float, float, float]] = ()  # further points of the body, in the flange frame


def entered(box: Box, points_m: Floats, clearance_m: float) -> tuple[int, float] | None:
    """Where a body of points (sample, point, 3) along a way enters a box's clearance, and how near (m) it then comes.

    None where it never does. An arm that stands too near already may leave, by a way on which it comes no nearer.
    """
    near_m = np.min(box.distance_m(points_m), axis=1)
    clear = np.flatnonzero(near_m >= clearance_m)
    leaves = int(clear[0]) if clear.size else len(near_m)
    backwards = np.flatnonzero(np.diff(near_m[: leaves + 1]) < -ROUNDING_M) + 1
    again = np.flatnonzero(near_m[leaves:] < clearance_m) + leaves
    hits = [*backwards[:1].tolist(), *again[:1].tolist()]
    return (min(hits), max(0.0, float(np.min(near_m[min(hits) :])))) if hits else None


def body_points(frames: Floats, tool_m: Sequence[tuple[float, float, float]]) -> Floats:
    """(pose, point, 3) along the links from the first joint on to the flange, and the tool's, from frames
    (pose, joint + 1, 4, 4).
    """
    origins = frames[:, 1:, :3, 3]
    shares = np.linspace(0.0, 1.0, LINK_POINTS)[:, None, None, None]
    along = (1.0 - shares) * origins[:, :-1] + shares * origins[:, 1:]
    points = [np.moveaxis(along, 0, 1).reshape(len(frames), -1, 3)]
    flange = frames[:, -1]
    for point in tool_m:
        points.append((flange[:, :3, :3] @ np.array(point) + flange[:, :3, 3])[:, None])
    return np.concatenate(points, axis=1)
