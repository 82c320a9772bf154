"""Flange poses of many rows at values that differ little from those already computed: only what changed is multiplied.

Exact, and no linearisation: behind a changed link or zero the arm moves as a whole.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.serial import SerialArm
from calibrate.diagnose.ported import offsets, perturbed_frames
from calibrate.effects.ports import Perturbation
from calibrate.rigid import inverse

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Flanges:
    """Of one arm at joint readings (row, joint) under one perturbation."""

    arm: SerialArm
    theta: Floats  # (param,)
    q_rad: Floats
    by: Perturbation
    frames: Floats  # (row, joint + 1, 4, 4)

    @classmethod
    def of(cls, arm: SerialArm, theta: Floats, q_rad: Floats, by: Perturbation) -> "Flanges":
        return cls(arm, theta, q_rad, by, perturbed_frames(arm, theta, q_rad, by))

    def at(self, theta: Floats) -> Floats:
        """(row, 4, 4) at other values (param,), the perturbation being the same."""
        was, now = self.arm.fixed_parts(self.theta), self.arm.fixed_parts(theta)
        turned = self.arm.angle_offset_rad(theta) - self.arm.angle_offset_rad(self.theta)
        flange = self.frames[:, -1]
        for k in range(self.arm.n_joints, -1, -1):  # from the flange: frames in front of a change are as they were
            if np.any(was[k] != now[k]):
                flange = _behind(self._before_offset(k), inverse(was[k]) @ now[k], flange)
            if k > 0 and turned[k - 1] != 0.0:
                flange = _behind(self.frames[:, k - 1], _about_z(float(turned[k - 1])), flange)
        return flange

    def _before_offset(self, k: int) -> Floats:
        """(row, 4, 4) frame k without what effects add there."""
        own = self.by.frames[:, k]
        return self.frames[:, k] @ inverse(offsets(own)) if np.any(own) else self.frames[:, k]


def _behind(B: Floats, D: Floats, T: Floats) -> Floats:
    """(row, 4, 4) T with all that is behind frames B moved by D, as seen in B."""
    return B @ (D @ (inverse(B) @ T))


def _about_z(angle_rad: float) -> Floats:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    out = np.eye(4)
    out[:2, :2] = [[c, -s], [s, c]]
    return out
