"""Turns about one axis that solve one small geometric question; every argument broadcasts over (..., 3).

Source: A. J. Elias, J. T. Wen, IK-Geo: unified robot inverse kinematics using subproblem decomposition, arXiv
2211.05737, subproblems 1, 3, 4 (Paden-Kahan and their completion). Where a solution is missed by little, as for poses
of a calibrated arm at the edge of the nominal one's reach, each gives the turn that comes nearest: a start, no answer.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SLACK = 0.02  # of the cosine; calibration moves it by a few thousandths, what is further out is out of reach


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
