"""The arm of a rig at one set of values: what aims, moves, guides and draws errors asks thousands of times.

Same forward kinematics as the fit (arms/serial.py), with all that does not depend on the joints worked out once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.arms.coupled_readings import uncoupled
from calibrate.model.arms.serial import SerialArm, chain_frames
from calibrate.model.parameters import values_by_name

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RigArm:
    """Implements acquisition.motion.kinematics.Kinematics and acquisition.guided.stillness.GuidedArm."""

    fixed: Floats  # (joint + 1, 4, 4) parts between the turns
    offset_rad: Floats  # (joint,) added to a reading
    lower_rad: Floats  # (joint,) of the readings
    upper_rad: Floats
    point_m: Floats = field(default_factory=lambda: np.zeros(3))  # (3,) of the tool in the flange; its origin: none
    by_reading: Floats | None = None  # (joint, joint) of coupled readings, as SerialArm.by_reading

    @classmethod
    def of(cls, arm: SerialArm, theta: Floats, lower_rad: Floats, upper_rad: Floats) -> Self:
        """`theta` (param,): values of the arm's own parameters."""
        parts, offset_rad = arm.fixed_parts(theta), arm.angle_offset_rad(theta)
        return cls(parts, offset_rad, lower_rad, upper_rad, by_reading=arm.by_reading)

    @classmethod
    def of_rig(cls, rig: Rig, corrections: Mapping[str, float] | None = None) -> Self:
        """Nominal, or with `corrections`: fitted values by parameter name, of which it takes those of the arm."""
        arm = arm_of(rig)
        known = {p.name for p in arm.parameters}
        theta = values_by_name(arm.parameters, {k: v for k, v in (corrections or {}).items() if k in known})
        point_m = np.array(rig.tool.point_m or (0.0, 0.0, 0.0))
        return replace(cls.of(arm, theta, *limits_of(rig)), point_m=point_m)

    @property
    def n_joints(self) -> int:
        return len(self.offset_rad)

    def frames(self, q_rad: Floats) -> Floats:
        """(pose, joint + 1, 4, 4) as SerialArm.frames: joint i + 1 turns about z of frame i, the last is the flange."""
        return chain_frames(self.fixed[0], self.fixed[1:], self.angles_rad(q_rad))

    def angles_rad(self, q_rad: Floats) -> Floats:
        """(pose, joint) turns of the joints at readings (pose, joint)."""
        return uncoupled(self.by_reading, q_rad) + self.offset_rad

    def flange(self, q_rad: Floats) -> Floats:
        """T_base_flange (4, 4) at joint readings (joint,)."""
        return self.frames(q_rad[None])[0, -1]

    def tip_m(self, q_rad: Floats) -> Floats:
        """(pose, 3) the tool's point in the base."""
        T = self.frames(q_rad)[:, -1]
        return T[:, :3, :3] @ self.point_m + T[:, :3, 3]


def limits_of(rig: Rig) -> tuple[Floats, Floats]:
    """(joint,) smallest and largest readings."""
    return np.array([j.lower_rad for j in rig.arm.joints]), np.array([j.upper_rad for j in rig.arm.joints])
