"""The believed arm with its laser, one pose at a time and cheap: what servo and pose plan ask thousands of times.

Same chain as the fit (arms/serial), of any arm model, with everything that does not depend on the joints worked out
once.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.dual_psd_rig import laser_of
from calibrate.parameters import values_by_name

Floats = NDArray[np.float64]


class BelievedArm:
    """Immutable; `corrections` are fitted values by parameter name, of which it takes those of arm and laser."""

    def __init__(self, rig: Rig, corrections: Mapping[str, float] | None = None) -> None:
        """DataError for a rig without laser."""
        arm, laser = arm_of(rig), laser_of(rig)
        parameters = arm.parameters + laser.parameters
        known = {p.name for p in parameters}
        theta = values_by_name(parameters, {k: v for k, v in (corrections or {}).items() if k in known})
        n = len(arm.parameters)
        self.n_joints = arm.n_joints
        self.lower_rad = np.array([j.lower_rad for j in rig.arm.joints])
        self.upper_rad = np.array([j.upper_rad for j in rig.arm.joints])
        fixed = arm.fixed_parts(theta[:n])
        self._base, self._tails = fixed[0], fixed[1:]
        self._offset_rad = arm.angle_offset_rad(theta[:n])
        self._laser_origin_m, direction = laser.in_flange(theta[n:])
        self._laser_direction = direction / np.linalg.norm(direction)

    def frames(self, q_rad: Floats) -> Floats:
        """T_base_frame (joint + 1, 4, 4): joint i + 1 turns about z of frame i; the last is the flange."""
        angle = np.asarray(q_rad, dtype=float) + self._offset_rad
        links = self._tails.copy()  # Rz(angle) times each tail: only its first two rows mix
        for i, a in enumerate(angle.tolist()):
            c, s = math.cos(a), math.sin(a)
            x, y = self._tails[i, 0], self._tails[i, 1]
            links[i, 0], links[i, 1] = c * x - s * y, s * x + c * y
        out = np.empty((self.n_joints + 1, 4, 4))
        out[0] = self._base
        for i in range(self.n_joints):
            np.matmul(out[i], links[i], out=out[i + 1])
        return out

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (4, 4) at joint readings (joint,)."""
        return self.frames(q_rad)[-1]

    def joint_jacobian(self, q_rad: Floats) -> Floats:
        """(6, joint) base-frame twist [v; w] of the flange by each joint (calibrate/rigid.py)."""
        z, o = _axes(self.frames(q_rad))
        return np.concatenate([turned(-o, z), z], axis=1).T

    def beam(self, q_rad: Floats) -> tuple[Floats, Floats]:
        """Origin (3,) m and unit direction (3,) of the laser beam in the base."""
        return self.beam_from(self.flange(q_rad))

    def beam_jacobian(self, q_rad: Floats) -> Floats:
        """(6, joint) d(origin, direction)/dq: z x (origin - o), z x direction."""
        T = self.frames(q_rad)
        origin, direction = self.beam_from(T[-1])
        z, o = _axes(T)
        return np.concatenate([turned(origin - o, z), turned(np.broadcast_to(direction, z.shape), z)], axis=1).T

    def beam_from(self, T_base_flange: Floats) -> tuple[Floats, Floats]:
        """The beam at a flange pose (4, 4)."""
        R = T_base_flange[:3, :3]
        return R @ self._laser_origin_m + T_base_flange[:3, 3], R @ self._laser_direction


def _axes(T: Floats) -> tuple[Floats, Floats]:
    """Joint axes (joint, 3) and points on them (joint, 3)."""
    return T[:-1, :3, 2], T[:-1, :3, 3]


def turned(lever: Floats, axis: Floats) -> Floats:
    """(..., 3) axis x lever, the velocity of a point at `lever` from the axis."""
    out = np.empty_like(lever)
    out[..., 0] = axis[:, 1] * lever[..., 2] - axis[:, 2] * lever[..., 1]
    out[..., 1] = axis[:, 2] * lever[..., 0] - axis[:, 0] * lever[..., 2]
    out[..., 2] = axis[:, 0] * lever[..., 1] - axis[:, 1] * lever[..., 0]
    return out
