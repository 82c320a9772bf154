"""Rigid motions: homogeneous transforms, twists and their adjoints.

Convention, everywhere in calibrate: a twist is [v; w] in the base frame, the velocity field of space: a point fixed
to the moving body at x moves with v + w x x, a direction u with w x u (v is the velocity of the body point that
passes the base origin). Source: Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 1994, ch. 2.4.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


def transform(origin_m: ArrayLike, rotation_rad: ArrayLike) -> Floats:
    """(4, 4) from an origin (3,) and a rotation vector (3,), or a row of them (row, 4, 4) from two of (row, 3)."""
    vector = np.asarray(rotation_rad, dtype=float)
    out = np.zeros((*vector.shape[:-1], 4, 4))
    out[..., :3, :3] = Rotation.from_rotvec(vector).as_matrix()
    out[..., :3, 3] = np.asarray(origin_m, dtype=float)
    out[..., 3, 3] = 1.0
    return out


def inverse(T_a_b: Floats) -> Floats:
    """(..., 4, 4) inverse T_b_a of affine maps whose linear part is orthogonal (mirrors included)."""
    out = np.zeros_like(T_a_b)
    linear = np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    out[..., :3, :3] = linear
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", linear, T_a_b[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def adjoint(T_a_b: Floats) -> Floats:
    """(6, 6) that turns a twist [v; w] given in frame b into frame a; T may contain a mirror (w is a pseudo-vector)."""
    linear = T_a_b[:3, :3]
    out = np.zeros((6, 6))
    out[:3, :3] = linear
    out[3:, 3:] = np.linalg.det(linear) * linear
    out[:3, 3:] = cross_matrix(T_a_b[:3, 3]) @ out[3:, 3:]
    return out


def cross_matrix(vector: Floats) -> Floats:
    """Skew matrix (..., 3, 3) of a vector (..., 3): matrix of a, times b, is a x b."""
    out = np.zeros((*vector.shape[:-1], 3, 3))
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    out[..., 0, 1], out[..., 0, 2] = -z, y
    out[..., 1, 0], out[..., 1, 2] = z, -x
    out[..., 2, 0], out[..., 2, 1] = -y, x
    return out


def cross(a: Floats, b: Floats) -> Floats:
    """(..., 3) a x b, broadcast; several times cheaper than numpy.cross on small arrays."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def turn_twist(axis: Floats, point_m: Floats) -> Floats:
    """(..., 6) twist of a turn about a unit axis (..., 3) through a point (..., 3)."""
    return np.concatenate([cross(point_m, axis), axis], axis=-1)


def slide_twist(direction: Floats) -> Floats:
    """(..., 6) twist of a shift along a unit direction (..., 3)."""
    return np.concatenate([direction, np.zeros_like(direction)], axis=-1)


def left_jacobian(rotation_rad: Floats) -> Floats:
    """(..., 3, 3) J with Exp(r + dr) = Exp(J dr) Exp(r) to first order, for rotation vectors (..., 3).

    Source: Sola, Deray, Atchuthan, A micro Lie theory, arXiv 1812.01537, eq. (145).
    """
    angle = np.sqrt(np.sum(rotation_rad**2, axis=-1))[..., None, None]
    small = angle < 1e-4  # series; the first dropped term is angle^3 / 24 < 1e-13
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    cross_r = cross_matrix(rotation_rad)
    return np.eye(3) + first * cross_r + second * cross_r @ cross_r


def pose_offset(deviation: Floats) -> Floats:
    """(4, 4) change of a pose, applied on its right, from shift (m) and rotation vector (rad) in one (6,), or a row."""
    return transform(deviation[..., :3], deviation[..., 3:])


def pose_offset_twists(T_base_nominal: Floats, deviation: Floats) -> Floats:
    """(..., 6, 6) base twist of the frame T_base_nominal @ pose_offset(deviation) by each of its six deviations.

    For one frame (4, 4) and deviation (6,), or many.
    """
    R = T_base_nominal[..., :3, :3]
    origin_m = T_base_nominal[..., :3, 3] + (R @ deviation[..., :3, None])[..., 0]
    out = np.zeros((*deviation.shape, 6))
    out[..., :3, :3] = R
    out[..., 3:, 3:] = R @ left_jacobian(deviation[..., 3:])
    out[..., :3, 3:] = cross_matrix(origin_m) @ out[..., 3:, 3:]
    return out
