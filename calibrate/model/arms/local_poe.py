"""Local product of exponentials: six errors for every fixed part, the reference model of an articulated-arm CMM.

T_(i-1,i) = T_(i-1,i)(0) E_(i-1) exp(xi (q_i + zero_i)), xi = (0, 0, 0, 0, 0, 1), T_base_flange = T_(0,1) ... T_(n-1,n)
T_(n,n+1)(0) E_n. Link i is the fixed part in front of joint i+1, link n the flange transform; E_i shifts by x, y, z and
turns by the rotation vector roll, pitch, yaw, both in the frame behind the part, whose z is the axis of joint i+1.
Source: Huang Kui et al., error simulation of a flexible arm coordinate measuring machine, eq. 1 to 3; Chen, Yang, Tan,
Local POE model for robot kinematic calibration, Mechanism and Machine Theory 36(11-12), 2001.
yaw of link i and the zero of joint i+1 are one and the same turn; there yaw is held, and the zero is the whole turn.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.link_tolerance import (
    LinkTolerance,
    link_angle,
    link_length,
    zero_parameter,
)
from calibrate.model.arms.serial import SerialArm
from calibrate.model.parameters import Parameter
from calibrate.model.rigid import left_jacobian, pose_offset

Floats = NDArray[np.float64]

PER_PART = 6  # x, y, z, roll, pitch, yaw
PER_JOINT = PER_PART + 1  # the part in front of the joint, then its zero


class LocalPoeArm(SerialArm):
    """KinematicModel of fixed parts T_(i-1,i)(0), (joint + 1, 4, 4); all parameters are corrections to them."""

    def __init__(self, parts: Floats, tolerance: LinkTolerance) -> None:
        n = len(parts) - 1
        self._parts = parts
        self._error_columns = np.add.outer(PER_JOINT * np.arange(n + 1), np.arange(PER_PART))  # (joint + 1, 6)
        self._zero_columns = PER_JOINT * np.arange(n) + PER_PART
        parameters = tuple(
            p for i in range(n) for p in (*_part_parameters(i, tolerance, own_yaw=False), zero_parameter(i + 1))
        )
        last = _part_parameters(n, tolerance, own_yaw=True)
        frames = np.repeat(np.arange(n + 1), PER_JOINT)[:-1]
        super().__init__(n, parameters + last, tuple(frames.tolist()))

    def fixed_parts(self, theta: Floats) -> Floats:
        return self._parts @ pose_offset(theta[self._error_columns])

    def angle_offset_rad(self, theta: Floats) -> Floats:
        return theta[self._zero_columns]

    def body_twists(self, theta: Floats) -> Floats:
        """Shifts act in front of the part's own turn; a turn is seen from behind by the transposed left Jacobian."""
        out = np.zeros((len(self.parameters), 6))
        out[self._zero_columns, 5] = 1.0
        errors = theta[self._error_columns]
        shifts, turns = self._error_columns[:, :3], self._error_columns[:, 3:]
        out[shifts, :3] = pose_offset(errors)[:, :3, :3]  # row k: its transpose times unit vector k
        out[turns, 3:] = left_jacobian(errors[:, 3:])  # row k: right Jacobian = transpose, column k
        return out


def _part_parameters(i: int, tolerance: LinkTolerance, *, own_yaw: bool) -> tuple[Parameter, ...]:
    return (
        *(link_length(f"link{i}.{axis}", tolerance) for axis in ("x", "y", "z")),
        link_angle(f"link{i}.roll", tolerance),
        link_angle(f"link{i}.pitch", tolerance),
        link_angle(f"link{i}.yaw", tolerance, own=own_yaw),
    )
