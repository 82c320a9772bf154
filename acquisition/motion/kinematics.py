"""Homogeneous transforms (..., 4, 4) as tasks write them, and what motion has to know of an arm: passed in, not
imported.

Joint i + 1 turns about z of frame i.
"""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


class Kinematics(Protocol):
    """An arm of turning joints, nominal or calibrated."""

    @property
    def lower_rad(self) -> Floats:
        """(joint,) smallest readings."""
        ...

    @property
    def upper_rad(self) -> Floats: ...

    def frames(self, q_rad: Floats) -> Floats:
        """T_base_frame (pose, joint + 1, 4, 4) at joint readings (pose, joint); the last is the flange."""
        ...


def flange(arm: Kinematics, q_rad: Floats) -> Floats:
    """T_base_flange (4, 4) at joint readings (joint,)."""
    out: Floats = arm.frames(q_rad[None])[0, -1]
    return out


def jacobian(frames: Floats, point_m: Floats | None = None) -> Floats:
    """(pose, 6, joint): velocity of a point of the flange (m) and turn (rad) in the base by each joint, of `frames`.

    `point_m` (pose, 3) in the base; None: the flange's origin.
    """
    moved_m = frames[:, -1, :3, 3] if point_m is None else point_m
    axes, arms_m = frames[:, :-1, :3, 2], moved_m[:, None] - frames[:, :-1, :3, 3]
    out = np.empty((len(frames), 6, frames.shape[1] - 1))
    out[:, 0] = axes[..., 1] * arms_m[..., 2] - axes[..., 2] * arms_m[..., 1]
    out[:, 1] = axes[..., 2] * arms_m[..., 0] - axes[..., 0] * arms_m[..., 2]
    out[:, 2] = axes[..., 0] * arms_m[..., 1] - axes[..., 1] * arms_m[..., 0]
    out[:, 3:] = np.swapaxes(axes, 1, 2)
    return out


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
