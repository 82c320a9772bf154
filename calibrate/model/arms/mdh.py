"""Modified Denavit-Hartenberg arm (Craig) with Hayati's extra tilt between near-parallel axes.

Row i of the rig holds alpha_(i-1), a_(i-1), d_i, theta_offset_i:
T_(i-1,i) = Rx(alpha_(i-1) + twist_(i-1)) Tx(a_(i-1) + length_(i-1)) Ry(tilt_(i-1))
            Rz(q_i + theta_offset_i + zero_i) Tz(d_i + offset_i),
T_base_flange = T_base_first T_(0,1) ... T_(n-1,n) T_n_flange.
Parameters carry Craig's indices: alpha and a of row i are twist and length of link i-1, the body in front of joint i.
So link<i>.length, twist, tilt and offset mean the same as in a standard table of the same arm (arms/dh.py).
Sources: Craig, Introduction to Robotics, 3rd ed. 2005, ch. 3.4, eq. 3.6; tilt as in Hayati, Mirmirani, J. Robotic
Systems 2(4), 1985, between the common normal and the turn. Where the axes cross at right angles the tilt turns about
the axis of joint i-1 and is held, as in arms/dh.py.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.dh import DhLink, nominal_rows, row_parameters
from calibrate.model.arms.link_tolerance import LinkTolerance
from calibrate.model.arms.serial import (
    SerialArm,
    rotation_x,
    rotation_y,
    shift,
)
from calibrate.model.rigid import slide_twist, turn_twist

Floats = NDArray[np.float64]

PER_ROW = 5  # zero, offset of link i; length, twist, tilt of link i-1


class MdhArm(SerialArm):
    """KinematicModel of a modified D-H table; all parameters are corrections to it."""

    def __init__(
        self,
        rows: tuple[DhLink, ...],
        tolerance: LinkTolerance,
        T_last_flange: Floats | None = None,
        T_base_first: Floats | None = None,
    ) -> None:
        self._nominal = nominal_rows(rows)
        self._T_last_flange = np.eye(4) if T_last_flange is None else T_last_flange
        self._T_base_first = np.eye(4) if T_base_first is None else T_base_first
        parameters = tuple(p for i, row in enumerate(rows, start=1) for p in row_parameters(i, i - 1, row, tolerance))
        super().__init__(len(rows), parameters, tuple(np.repeat(np.arange(len(rows)), PER_ROW).tolist()))

    def fixed_parts(self, theta: Floats) -> Floats:
        """Tz(d) commutes with the turn and stands in front of it."""
        _, d, a, alpha, tilt = self._rows(theta)
        along_x = rotation_x(alpha) @ shift(a, np.zeros_like(a))
        along_z = rotation_y(tilt) @ shift(np.zeros_like(d), d)
        parts = np.concatenate([along_x @ along_z, self._T_last_flange[None]])
        parts[0] = self._T_base_first @ parts[0]
        return parts

    def angle_offset_rad(self, theta: Floats) -> Floats:
        return self._nominal[:, 0] + theta[::PER_ROW]

    def body_twists(self, theta: Floats) -> Floats:
        """In the frame in front of each turn: x and the middle of the tilt lie d below its origin."""
        _, d, _, _, tilt = self._rows(theta)
        zero, one = np.zeros_like(d), np.ones_like(d)
        x, y = np.stack([np.cos(tilt), zero, np.sin(tilt)], axis=-1), np.stack([zero, one, zero], axis=-1)
        z, foot_m = np.stack([zero, zero, one], axis=-1), np.stack([zero, zero, -d], axis=-1)
        by_kind = [turn_twist(z, foot_m), slide_twist(z), slide_twist(x), turn_twist(x, foot_m), turn_twist(y, foot_m)]
        return np.stack(by_kind, axis=1).reshape(-1, 6)

    def _rows(self, theta: Floats) -> Floats:
        """(5, joint) theta offset, d, a, alpha, tilt as corrected."""
        return (self._nominal + theta.reshape(-1, PER_ROW)).T
