"""Orientations as controllers and tables write them: angles, vectors and quaternions to matrices, and back.

KUKA A, B, C turn about z, y, x of the turning frame; FANUC W, P, R about fixed x, y, z, which is the same product with
the angles named the other way round; ABB's quaternion has its scalar first; UR has a rotation vector.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RotationForm:
    """Columns or literals that state an orientation; radians where they are angles."""

    names: tuple[str, ...]
    to_matrix: Callable[[Floats], Floats]  # (pose, k) -> (pose, 3, 3)
    from_matrix: Callable[[Floats], Floats]


def _vector(values: Floats) -> Floats:
    return Rotation.from_rotvec(values).as_matrix()


def _from_vector(R: Floats) -> Floats:
    return Rotation.from_matrix(R).as_rotvec()


def _zyx(values: Floats) -> Floats:
    return Rotation.from_euler("ZYX", values).as_matrix()


def _from_zyx(R: Floats) -> Floats:
    """Roll is read after yaw and pitch are taken away: exact where roll and yaw alone are undefined."""
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    along = c[:, None] * R[:, 0] + s[:, None] * R[:, 1]
    across = c[:, None] * R[:, 1] - s[:, None] * R[:, 0]
    pitch = np.arctan2(-R[:, 2, 0], along[:, 0])
    return np.stack([yaw, pitch, np.arctan2(-across[:, 2], across[:, 1])], axis=1)


def _fixed_xyz(values: Floats) -> Floats:
    return _zyx(values[:, ::-1])


def _from_fixed_xyz(R: Floats) -> Floats:
    return _from_zyx(R)[:, ::-1]


def _quaternion(values: Floats) -> Floats:
    return Rotation.from_quat(values, scalar_first=True).as_matrix()


def _from_quaternion(R: Floats) -> Floats:
    return Rotation.from_matrix(R).as_quat(canonical=True, scalar_first=True)


VECTOR = RotationForm(("rx", "ry", "rz"), _vector, _from_vector)
KUKA = RotationForm(("a", "b", "c"), _zyx, _from_zyx)
FANUC = RotationForm(("w", "p", "r"), _fixed_xyz, _from_fixed_xyz)
QUATERNION = RotationForm(("qw", "qx", "qy", "qz"), _quaternion, _from_quaternion)
FORMS = (VECTOR, KUKA, FANUC, QUATERNION)


def pose(position_m: Floats, R: Floats) -> Floats:
    """(pose, 4, 4)"""
    T = np.broadcast_to(np.eye(4), (len(position_m), 4, 4)).copy()
    T[:, :3, :3], T[:, :3, 3] = R, position_m
    return T
