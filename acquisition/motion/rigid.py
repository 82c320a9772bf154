"""Homogeneous transforms (..., 4, 4) as tasks write them: from origin and rotation vector, inverse, difference."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


def transform(origin_m: ArrayLike = (0.0, 0.0, 0.0), rotation_rad: ArrayLike = (0.0, 0.0, 0.0)) -> Floats:
    """(..., 4, 4) from origins (..., 3) and rotation vectors (..., 3)."""
    origin, turn = np.broadcast_arrays(np.asarray(origin_m, dtype=float), np.asarray(rotation_rad, dtype=float))
    out = np.zeros((*origin.shape[:-1], 4, 4))
    out[..., :3, :3] = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(*turn.shape[:-1], 3, 3)
    out[..., :3, 3] = origin
    out[..., 3, 3] = 1.0
    return out


def inverse(T_a_b: Floats) -> Floats:
    """T_b_a (..., 4, 4)."""
    out = np.zeros_like(T_a_b)
    turned = np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    out[..., :3, :3] = turned
    out[..., :3, 3] = -np.einsum("...ij,...j->...i", turned, T_a_b[..., :3, 3])
    out[..., 3, 3] = 1.0
    return out


def rotation_vector(R: Floats) -> Floats:
    """(..., 3) rad of rotations (..., 3, 3)."""
    out: Floats = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(*R.shape[:-2], 3)
    return out


def apart(T_a: Floats, T_b: Floats) -> tuple[float, float]:
    """How far two poses (4, 4) are from each other: m between origins, rad of the turn."""
    turn = rotation_vector(T_a[:3, :3].T @ T_b[:3, :3])
    return float(np.linalg.norm(T_b[:3, 3] - T_a[:3, 3])), float(np.linalg.norm(turn))
