"""The arm of a rig as motion needs it: nominal, or with the corrections of an identified model."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig_schema import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.arms.serial import SerialArm
from calibrate.parameters import values_by_name

Floats = NDArray[np.float64]


class MotionArm:
    """Implements acquisition.motion.inverse.kinematics.Kinematics; immutable."""

    def __init__(self, arm: SerialArm, theta: Floats, lower_rad: Floats, upper_rad: Floats) -> None:
        self.lower_rad, self.upper_rad = lower_rad, upper_rad
        self._parts = arm.fixed_parts(theta)
        self._offset_rad = arm.angle_offset_rad(theta)

    def frames(self, q_rad: Floats) -> Floats:
        """As SerialArm.frames, its products flattened: five times faster for batches of inverse kinematics."""
        angle = q_rad + self._offset_rad
        c, s = np.cos(angle), np.sin(angle)
        out = np.empty((len(q_rad), len(self._parts), 4, 4))
        out[:, 0] = self._parts[0]
        for i, part in enumerate(self._parts[1:]):
            before, ci, si = out[:, i], c[:, i, None], s[:, i, None]
            turned = before.copy()
            turned[:, :, 0] = ci * before[:, :, 0] + si * before[:, :, 1]
            turned[:, :, 1] = ci * before[:, :, 1] - si * before[:, :, 0]
            out[:, i + 1] = (turned.reshape(-1, 4) @ part).reshape(-1, 4, 4)
        return out


def motion_arm(rig: Rig, corrections: Mapping[str, float] | None = None) -> MotionArm:
    """`corrections`: fitted values by parameter name; those that are not of the arm are left out."""
    arm = arm_of(rig)
    known = {p.name for p in arm.parameters}
    theta = values_by_name(arm.parameters, {k: v for k, v in (corrections or {}).items() if k in known})
    joints = rig.arm.joints
    return MotionArm(arm, theta, np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints]))
