"""The assumed arm with its laser: what servo and pose plan ask, one pose at a time."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.model.arms.coupled_readings import by_readings
from calibrate.model.arms.rig_arm import RigArm
from calibrate.model.dual_psd_rig import laser_of
from calibrate.model.parameters import values_by_name
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class BelievedArm(RigArm):
    """Implements `acquisition.centring.aim.BelievedArm`."""

    laser_origin_m: Floats  # (3,) in the flange
    laser_direction: Floats  # (3,) unit

    def beam(self, q_rad: Floats) -> tuple[Floats, Floats]:
        """Origin (3,) m and unit direction (3,) of the laser beam in the base, for readings (joint,)."""
        return self.beam_from(self.flange(q_rad))

    def beam_jacobian(self, q_rad: Floats) -> Floats:
        """(6, joint) d(origin, direction)/dq: z x (origin - o), z x direction by the turn of a joint."""
        T = self.frames(q_rad[None])[0]
        (origin, direction), axes = self.beam_from(T[-1]), T[:-1, :3, 2]
        by_angle = np.concatenate([cross(axes, origin - T[:-1, :3, 3]), cross(axes, direction)], axis=1).T
        return by_readings(self.by_reading, by_angle)

    def beam_from(self, T_base_flange: Floats) -> tuple[Floats, Floats]:
        """The beam at a flange pose (4, 4)."""
        R = T_base_flange[:3, :3]
        return R @ self.laser_origin_m + T_base_flange[:3, 3], R @ self.laser_direction


def believed_arm(rig: Rig, corrections: Mapping[str, float] | None = None) -> BelievedArm:
    """`corrections`: fitted values by parameter name, of which it takes those of arm and laser. DataError: no laser."""
    laser, given = laser_of(rig), corrections or {}
    known = {p.name for p in laser.parameters}
    mount = values_by_name(laser.parameters, {k: v for k, v in given.items() if k in known})
    origin_m, direction = laser.in_flange(mount)
    unit = direction / np.linalg.norm(direction)
    return BelievedArm(**vars(RigArm.of_rig(rig, given)), laser_origin_m=origin_m, laser_direction=unit)
