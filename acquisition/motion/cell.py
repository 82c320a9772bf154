"""What the cell allows: boxes that nothing may enter, areas in which the tool is slow, and how near is too near.

Boxes lie along the axes of the robot's base.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LINK_POINTS = 8  # on every link, for its distance to a box: 5 cm apart on the longest link of a small arm


@dataclass(frozen=True)
class Box:
    """A named box (m, base frame)."""

    name: str
    lower_m: tuple[float, float, float]
    upper_m: tuple[float, float, float]

    def distance_m(self, points_m: Floats) -> Floats:
        """(...) from points (..., 3) to the box, 0 inside."""
        beyond = np.maximum(np.maximum(np.array(self.lower_m) - points_m, points_m - np.array(self.upper_m)), 0.0)
        return np.asarray(np.linalg.norm(beyond, axis=-1))


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
