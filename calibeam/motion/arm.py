"""The arm of a rig as motion needs it: nominal, or with the corrections of an identified model."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.arms.catalogue import arm_of
from calibrate.arms.serial import SerialArm, chain_frames
from calibrate.parameters import values_by_name

Floats = NDArray[np.float64]


class MotionArm:
    """Implements acquisition.motion.inverse.kinematics.Kinematics; immutable."""

    def __init__(self, arm: SerialArm, theta: Floats, lower_rad: Floats, upper_rad: Floats) -> None:
        self.lower_rad, self.upper_rad = lower_rad, upper_rad
        self._parts = arm.fixed_parts(theta)
        self._offset_rad = arm.angle_offset_rad(theta)

    def frames(self, q_rad: Floats) -> Floats:
        """As SerialArm.frames, with what does not depend on the joints worked out once."""
        return chain_frames(self._parts[0], self._parts[1:], q_rad + self._offset_rad)


def motion_arm(rig: Rig, corrections: Mapping[str, float] | None = None) -> MotionArm:
    """`corrections`: fitted values by parameter name; those that are not of the arm are left out."""
    arm = arm_of(rig)
    known = {p.name for p in arm.parameters}
    theta = values_by_name(arm.parameters, {k: v for k, v in (corrections or {}).items() if k in known})
    joints = rig.arm.joints
    return MotionArm(arm, theta, np.array([j.lower_rad for j in joints]), np.array([j.upper_rad for j in joints]))
