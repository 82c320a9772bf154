"""What the cell allows: boxes that nothing may enter, areas in which the tool is slow, and how near is too near.

Boxes lie along the axes of the robot's base. The arm is lines, each as thick as the clearance: from joint to joint, and
along every link through its centre of mass, because a link may lie beside the line between its joints (the upper arm of
a UR5e by 0.11 m). What hangs on the flange is points.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SIDES = ("lower", "upper")
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
        return _distance_m(np.array(self.lower_m), np.array(self.upper_m), points_m)


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
    com_m: Sequence[tuple[float, float, float] | None] = ()  # of every link in its own frame, where the rig file has it


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


@dataclass(frozen=True, eq=False)
class Body:
    """Points of an arm, each fixed to a link: its frame's number (point,) and place in it (point, 3)."""

    frame: NDArray[np.intp]
    local_m: Floats

    def at(self, frames: Floats) -> Floats:
        """(pose, point, 3) m in the base, from frames (pose, frame, 4, 4)."""
        T = frames[:, self.frame]
        out: Floats = np.matmul(T[..., :3, :3], self.local_m[..., None])[..., 0] + T[..., :3, 3]
        return out


def body_of(
    frames: Floats,
    tool_m: Sequence[tuple[float, float, float]],
    com_m: Sequence[tuple[float, float, float] | None] = (),
) -> Body:
    """Points along the links from the first joint on to the flange, beside them where their centres of mass `com_m`
    are, and the tool's, from the frames (joint + 1, 4, 4) of any posture: joints turn, links stay as they are.
    """
    numbers: list[int] = []
    local: list[Floats] = []
    for i in range(2, len(frames)):
        begin_m = frames[i, :3, :3].T @ (frames[i - 1, :3, 3] - frames[i, :3, 3])  # the end is the frame's origin
        along = np.linspace(1.0, 0.0, LINK_POINTS)[:, None] * begin_m
        lines = [along]
        com = com_m[i - 1] if i <= len(com_m) else None
        if com is not None:
            share = np.dot(com, begin_m) / max(float(begin_m @ begin_m), ROUNDING_M**2)
            lines.append(along + np.array(com) - share * begin_m)
        numbers += [i] * LINK_POINTS * len(lines)
        local += lines
    numbers += [len(frames) - 1] * len(tool_m)
    return Body(np.array(numbers), np.concatenate([*local, np.array(tool_m, dtype=np.float64).reshape(-1, 3)]))


def body_points(
    frames: Floats,
    tool_m: Sequence[tuple[float, float, float]],
    com_m: Sequence[tuple[float, float, float] | None] = (),
) -> Floats:
    """(pose, point, 3) of the body, from frames (pose, joint + 1, 4, 4)."""
    return body_of(frames[0], tool_m, com_m).at(frames)


def nearest_m(boxes: Sequence[Box], points_m: Floats) -> Floats:
    """(box,) from the nearest of points (point, 3) to each box; inside it the depth, negative."""
    lower, upper = (np.array([getattr(box, f"{side}_m") for box in boxes]).reshape(-1, 1, 3) for side in SIDES)
    return _distance_m(lower, upper, points_m).min(axis=1)


def _distance_m(lower_m: Floats, upper_m: Floats, points_m: Floats) -> Floats:
    beyond = np.maximum(lower_m - points_m, points_m - upper_m)
    outside = np.sqrt(np.sum(np.maximum(beyond, 0.0) ** 2, axis=-1))
    return np.asarray(outside + np.minimum(np.max(beyond, axis=-1), 0.0))
