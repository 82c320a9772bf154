"""The typed face of the compiled loops for serial arms: flange poses, and a point of the flange with its derivatives.

The arm says once what its parameter values mean (fixed parts, joint offsets, a constant twist for each parameter:
arms/serial.py); the loops over poses are compiled. One thread; results agree with the numpy models to 1e-12.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # the arms use this file in turn
    from calibrate.arms.serial import SerialArm

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class ArmConstants:
    """All that a serial arm is at one set of parameter values."""

    fixed: Floats  # (joint + 1, 4, 4) parts between the turns
    offset_rad: Floats  # (joint,) added to a reading
    moves_frame: Indices  # (param,) frame that a parameter moves
    body_twists: Floats  # (param, 6) [v; w] by a parameter in the frame that it moves

    @classmethod
    def of(cls, arm: "SerialArm", theta: Floats) -> Self:
        """`theta` (param,): values of the arm's own parameters."""
        return cls(
            np.ascontiguousarray(arm.fixed_parts(theta)),
            np.ascontiguousarray(arm.angle_offset_rad(theta)),
            np.array(arm.moves_frame, dtype=np.intp),
            np.ascontiguousarray(arm.body_twists(theta)),
        )

    def of_columns(self, columns: Indices) -> Self:
        """The same arm, where only these parameters are asked for, in this order."""
        return type(self)(self.fixed, self.offset_rad, self.moves_frame[columns], self.body_twists[columns])


def flange(arm: ArmConstants, q_rad: Floats) -> Floats:
    """T_base_flange (pose, 4, 4) for readings (pose, joint); nan where a joint is beyond 1e8 rad or nan."""
    from calibrate.kernels import compiled

    out = np.empty((len(q_rad), 16))
    compiled.flange(arm.fixed, arm.offset_rad, np.ascontiguousarray(q_rad), out)
    return out.reshape(-1, 4, 4)


def twists(arm: ArmConstants, q_rad: Floats) -> Floats:
    """Base twists [v; w] of the flange by every parameter, (pose, 6, param)."""
    from calibrate.kernels import compiled

    out = np.empty((len(q_rad), 6, len(arm.moves_frame)))
    q = np.ascontiguousarray(q_rad)
    compiled.twists(arm.fixed, arm.offset_rad, arm.moves_frame, arm.body_twists, q, out)
    return out


def point_and_jacobian(arm: ArmConstants, point_m: Floats, q_rad: Floats) -> tuple[Floats, Floats]:
    """A point (3,) of the flange frame in the base, (pose, 3), and its derivative by every parameter (pose, 3, param).

    Both are views of memory that runs over the poses first.
    """
    from calibrate.kernels import compiled

    poses, columns = len(q_rad), len(arm.moves_frame)
    point, jacobian = np.empty((3, poses)), np.empty((3 * columns, poses))
    q = np.ascontiguousarray(q_rad)
    compiled.point_jacobian(
        arm.fixed, arm.offset_rad, arm.moves_frame, arm.body_twists, np.ascontiguousarray(point_m), q, point, jacobian
    )
    return point.T, jacobian.reshape(columns, 3, poses).transpose(2, 1, 0)
