"""All eight closed-form solutions of two kinds of nominal arm: the starts for the numeric solution of calibrated ones.

Works on the joint axes at zero, read off the model, so that the convention of its table does not matter.
Source: A. J. Elias, J. T. Wen, IK-Geo, arXiv 2211.05737, ch. IV (spherical wrist with axes 2, 3 parallel; axes 2, 3, 4
parallel with axes 5, 6 meeting).

Turns about one axis that solve one small geometric question; every argument broadcasts over (..., 3).
Source: A. J. Elias, J. T. Wen, IK-Geo: unified robot inverse kinematics using subproblem decomposition, arXiv
2211.05737, subproblems 1, 3, 4 (Paden-Kahan and their completion). Where a solution is missed by little, as for poses
of a calibrated arm at the edge of the nominal one's reach, each gives the turn that comes nearest: a start, no answer.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.kinematics import Kinematics, inverse

Floats = NDArray[np.float64]
Starts = Callable[[Floats], Floats]  # T_base_flange (pose, 4, 4) -> joint readings (pose, branch, joint), NaN for none

SAME_M = 1e-6  # axes of a drawing meet exactly, or miss by far more
SAME_SINE = 1e-6

SLACK = 0.02  # of the cosine; calibration moves it by a few thousandths, what is further out is out of reach


@dataclass(frozen=True, eq=False)
class Axes:
    """The arm at zero: a point on, and the direction of, every axis (joint, 3); the flange (4, 4)."""

    point_m: Floats
    axis: Floats
    T_base_flange: Floats


def closed_form(nominal: Kinematics) -> Starts | None:
    """The branches of an arm with spherical wrist, or of UR's kind; None for any other."""
    frames = nominal.frames(np.zeros((1, nominal.lower_rad.size)))[0]
    axes = Axes(frames[:-1, :3, 3], frames[:-1, :3, 2], frames[-1])
    if len(axes.axis) != 6 or not _parallel(axes, 1, 2):
        return None
    wrist_m = _meeting(axes, 4, 5)
    if wrist_m is None:
        return None
    if _parallel(axes, 2, 3):
        return lambda T: _branches(axes, T, wrist_m, _three_parallel)
    if _off_axis_m(axes, 3, wrist_m) < SAME_M:
        return lambda T: _branches(axes, T, wrist_m, _spherical_wrist)
    return None


@dataclass(frozen=True, eq=False)
class _Shoulder:
    """What is left for joints 2 to 6 once joint 1 is known: wrist point (pose, 3), turn of the flange (pose, 3, 3)."""

    wrist_m: Floats
    turn: Floats


Rest = Callable[[Axes, _Shoulder, Floats, int, int], list[Floats]]


def _branches(axes: Axes, T: Floats, wrist_zero_m: Floats, rest: Rest) -> Floats:
    """Joint 1 puts the wrist as far along axis 2 as at zero; the rest by kind, with two choices of two more."""
    moved = T @ inverse(axes.T_base_flange)
    wrist_m = np.einsum("pij,j->pi", moved[:, :3, :3], wrist_zero_m) + moved[:, :3, 3]
    h1, h2, o1 = axes.axis[0], axes.axis[1], axes.point_m[0]
    backs = to_plane(h2, h1, wrist_m - o1, np.asarray(h2 @ (wrist_zero_m - o1)))
    out: list[Floats] = []
    for back in backs:
        shoulder = _Shoulder(turned(h1, back, wrist_m - o1) + o1, _turned_all(h1, back, moved[:, :3, :3]))
        for bend, flip in product((0, 1), (0, 1)):
            out.append(np.stack([-back, *rest(axes, shoulder, wrist_zero_m, bend, flip)], axis=-1))
    q_rad = np.stack(out, axis=1)
    return (q_rad + np.pi) % (2.0 * np.pi) - np.pi


def _spherical_wrist(axes: Axes, shoulder: _Shoulder, wrist_zero_m: Floats, bend: int, flip: int) -> list[Floats]:
    h, o = axes.axis, axes.point_m
    reach_m = np.linalg.norm(shoulder.wrist_m - o[1], axis=-1)
    q3 = to_distance(h[2], wrist_zero_m - o[2], o[1] - o[2], reach_m)[bend]
    q2 = onto(h[1], turned(h[2], q3, wrist_zero_m - o[2]) + o[2] - o[1], shoulder.wrist_m - o[1])
    turn = _turned_all(h[1], -q2 - _sign(h, 2) * q3, shoulder.turn)
    end = turn @ h[5]
    q5 = to_plane(h[3], h[4], h[5], end @ h[3])[flip]
    q4 = onto(h[3], turned(h[4], q5, h[5]), end)
    q6 = -onto(h[5], turned(h[4], -q5, h[3]), np.einsum("pij,i->pj", turn, h[3]))
    return [q2, q3, q4, q5, q6]


def _three_parallel(axes: Axes, shoulder: _Shoulder, wrist_zero_m: Floats, bend: int, flip: int) -> list[Floats]:
    h, o = axes.axis, axes.point_m
    end = shoulder.turn @ h[5]
    q5 = to_plane(h[1], h[4], h[5], end @ h[1])[flip]
    all_three = onto(h[1], turned(h[4], q5, h[5]), end)  # of joints 2, 3, 4, counted about axis 2
    across = np.cross(h[5], h[4])
    left = turned(h[4], -q5, turned(h[1], -all_three, shoulder.turn @ across))
    q6 = onto(h[5], across, left)
    elbow_m = shoulder.wrist_m - turned(h[1], all_three, wrist_zero_m - o[3])
    q3 = to_distance(h[2], o[3] - o[2], o[1] - o[2], np.linalg.norm(elbow_m - o[1], axis=-1))[bend]
    q2 = onto(h[1], turned(h[2], q3, o[3] - o[2]) + o[2] - o[1], elbow_m - o[1])
    q4 = _sign(h, 3) * (all_three - q2 - _sign(h, 2) * q3)
    return [q2, q3, q4, q5, q6]


def _turned_all(axis: Floats, angle_rad: Floats, R: Floats) -> Floats:
    """(pose, 3, 3) rotations after a turn."""
    return np.swapaxes(turned(axis, angle_rad[:, None], np.swapaxes(R, 1, 2)), 1, 2)


def _sign(h: Floats, joint: int) -> float:
    """+1 where an axis has the direction of axis 2, -1 where it has the opposite one."""
    return float(np.sign(h[1] @ h[joint]))


def _parallel(axes: Axes, i: int, j: int) -> bool:
    return bool(np.linalg.norm(np.cross(axes.axis[i], axes.axis[j])) < SAME_SINE)


def _meeting(axes: Axes, i: int, j: int) -> Floats | None:
    """The point (3,) where two axes meet; None where they do not."""
    directions = np.stack([axes.axis[i], -axes.axis[j]], axis=1)
    ways, _, rank, _ = np.linalg.lstsq(directions, axes.point_m[j] - axes.point_m[i], rcond=SAME_SINE)
    point_m = axes.point_m[i] + ways[0] * axes.axis[i]
    return point_m if rank == 2 and _off_axis_m(axes, j, point_m) < SAME_M else None


def _off_axis_m(axes: Axes, i: int, point_m: Floats) -> float:
    return float(np.linalg.norm(np.cross(axes.axis[i], point_m - axes.point_m[i])))


def turned(axis: Floats, angle_rad: Floats, vector: Floats) -> Floats:
    """(..., 3) a vector after a turn about a unit axis; Rodrigues' formula."""
    c, s = np.cos(angle_rad)[..., None], np.sin(angle_rad)[..., None]
    along = axis * _dot(axis, vector)[..., None]
    out: Floats = along + c * (vector - along) + s * _cross(axis, vector)
    return out


def onto(axis: Floats, start: Floats, end: Floats) -> Floats:
    """(...) the turn that brings `start` to `end`, or nearest to it (subproblem 1)."""
    across = start - axis * _dot(axis, start)[..., None]
    return np.arctan2(_dot(_cross(axis, start), end), _dot(across, end))


def to_plane(normal: Floats, axis: Floats, vector: Floats, distance: Floats) -> tuple[Floats, Floats]:
    """(...) both turns with normal . turned(vector) = distance (subproblem 4); NaN where it is out of reach."""
    along = _dot(normal, axis) * _dot(axis, vector)
    sine = _dot(normal, _cross(axis, vector))
    cosine = _dot(normal, vector) - along
    size = np.maximum(np.hypot(sine, cosine), 1e-15)  # a vector on the axis: any turn serves
    ratio = (distance - along) / size
    reachable = np.where(np.abs(ratio) > 1.0 + SLACK, np.nan, np.clip(ratio, -1.0, 1.0))
    middle, half = np.arctan2(sine, cosine), np.arccos(reachable)
    return middle + half, middle - half


def to_distance(axis: Floats, vector: Floats, centre: Floats, distance: Floats) -> tuple[Floats, Floats]:
    """(...) both turns with |turned(vector) - centre| = distance (subproblem 3, as a subproblem 4)."""
    wanted = 0.5 * (_dot(vector, vector) + _dot(centre, centre) - distance**2)
    return to_plane(centre, axis, vector, wanted)


def _cross(a: Floats, b: Floats) -> Floats:
    """(..., 3) a x b; several times cheaper than numpy.cross."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def _dot(a: Floats, b: Floats) -> Floats:
    out: Floats = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return out
