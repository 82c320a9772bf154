"""The laser on the flange: a line with four unknowns, two shifts across the beam and two tilts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.optics.reflection import Beam
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]

SHIFT_PLAUSIBLE_M = 5e-3  # a hand-fitted bracket; only scales columns and decides when a sigma is no result
TILT_PLAUSIBLE_RAD = 0.05
N_PARAMETERS = 4


@dataclass(frozen=True)
class LaserMount:
    """Nominal beam, in the flange frame, and two axes u, v across it.

    origin = origin_m + shift_u u + shift_v v;  direction = direction + tilt_u u + tilt_v v (not of unit length: tilts
    are tangents). Sliding along the beam and turning about it change nothing, so they are no parameters.
    """

    origin_m: Floats  # (3,)
    direction: Floats  # (3,) unit
    u: Floats  # (3,) unit
    v: Floats  # (3,) unit

    @classmethod
    def from_drawing(cls, origin_m: Floats, direction: Floats) -> "LaserMount":
        """Axis u is the flange axis most across the beam, made perpendicular; v = direction x u."""
        d = direction / np.linalg.norm(direction)
        axis = np.eye(3)[int(np.argmin(np.abs(d)))]
        u = axis - (axis @ d) * d
        u = u / np.linalg.norm(u)
        return cls(np.asarray(origin_m, dtype=float), d, u, cross(d, u))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("laser.shift_u", "m", SHIFT_PLAUSIBLE_M),
            Parameter("laser.shift_v", "m", SHIFT_PLAUSIBLE_M),
            Parameter("laser.tilt_u", "rad", TILT_PLAUSIBLE_RAD),
            Parameter("laser.tilt_v", "rad", TILT_PLAUSIBLE_RAD),
        )

    def in_flange(self, mount: Floats) -> tuple[Floats, Floats]:
        """Origin and direction (3,), (3,) in the flange frame for the four values."""
        return (
            self.origin_m + mount[0] * self.u + mount[1] * self.v,
            self.direction + mount[2] * self.u + mount[3] * self.v,
        )

    def beam(self, mount: Floats, T_base_flange: Floats) -> Beam:
        """Beams in the base frame at flange poses (pose, 4, 4)."""
        origin, direction = self.in_flange(mount)
        R = T_base_flange[:, :3, :3]
        return Beam(R @ origin + T_base_flange[:, :3, 3], R @ direction)
