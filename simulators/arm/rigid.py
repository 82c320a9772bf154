"""Rigid motions of many samples at once, as homogeneous matrices (row, 4, 4)."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]


def turned(rotation_rad: ArrayLike) -> Floats:
    """A turn about the origin: rotation vectors (row, 3) to (row, 4, 4)."""
    rotation = np.asarray(rotation_rad, dtype=np.float64)
    motion = np.zeros((*rotation.shape[:-1], 4, 4))
    motion[..., :3, :3] = Rotation.from_rotvec(rotation.reshape(-1, 3)).as_matrix().reshape(*rotation.shape[:-1], 3, 3)
    motion[..., 3, 3] = 1.0
    return motion


def shifted(shift_m: ArrayLike) -> Floats:
    """A shift: (row, 3) to (row, 4, 4)."""
    shift = np.asarray(shift_m, dtype=np.float64)
    motion = np.zeros((*shift.shape[:-1], 4, 4))
    motion[..., range(4), range(4)] = 1.0
    motion[..., :3, 3] = shift
    return motion


def moved(shift_m: ArrayLike, rotation_rad: ArrayLike) -> Floats:
    """A turn about the origin, then a shift: both (row, 3), to (row, 4, 4)."""
    motion = turned(rotation_rad)
    motion[..., :3, 3] = shift_m
    return motion


def turned_about(point_m: ArrayLike, rotation_rad: ArrayLike) -> Floats:
    """A turn about a line through `point_m` (3,) or (row, 3)."""
    point = np.asarray(point_m, dtype=np.float64)
    motion = turned(rotation_rad)
    motion[..., :3, 3] = point - np.einsum(
        "...ij,...j->...i", motion[..., :3, :3], np.broadcast_to(point, motion[..., :3, 3].shape)
    )
    return motion


def inverse(motion: Floats) -> Floats:
    """The motion back, (..., 4, 4)."""
    back = np.zeros_like(motion)
    back[..., :3, :3] = np.swapaxes(motion[..., :3, :3], -1, -2)
    back[..., :3, 3] = -np.einsum("...ij,...j->...i", back[..., :3, :3], motion[..., :3, 3])
    back[..., 3, 3] = 1.0
    return back


def about_z(angle_rad: Floats) -> Floats:
    """Turns about z: (row,) to (row, 4, 4)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    motion = np.zeros((*angle_rad.shape, 4, 4))
    motion[..., 0, 0] = cosine
    motion[..., 1, 1] = cosine
    motion[..., 0, 1] = -sine
    motion[..., 1, 0] = sine
    motion[..., 2, 2] = 1.0
    motion[..., 3, 3] = 1.0
    return motion
