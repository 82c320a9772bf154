"""Standard Denavit-Hartenberg arm with Hayati's extra tilt on every link.

T_i = Rz(q_i + theta_offset_i + zero_i) Tz(d_i + offset_i) Tx(a_i + length_i) Rx(alpha_i + twist_i) Ry(tilt_i),
T_base_flange = T_base_first T_1 ... T_n T_n_flange.
Sources: Denavit, Hartenberg, J. Appl. Mech. 22, 1955; Hayati, Mirmirani, J. Robotic Systems 2(4), 1985 (tilt, there
for near-parallel axes only). On a link with alpha = +-90 deg the tilt turns about an axis parallel to the link's own
joint: zero and tilt then only add up. So there the tilt is held, and `joint.zero` is by definition the whole turn.
"""

import math
from dataclasses import dataclass

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
from calibrate.model.rigid import adjoint, inverse

Floats = NDArray[np.float64]

PER_LINK = 5  # zero, offset, length, twist, tilt
PARALLEL_COSINE = 0.9  # of the twist: within 25 deg of parallel a tilt is something of its own


@dataclass(frozen=True)
class DhLink:
    """Nominal values of one row of a D-H table, standard or modified."""

    theta_offset_rad: float
    d_m: float
    a_m: float
    alpha_rad: float


class DhArm(SerialArm):
    """KinematicModel of a D-H table; all parameters are corrections to it, zero, offset, length, twist, tilt a link."""

    def __init__(
        self,
        links: tuple[DhLink, ...],
        tolerance: LinkTolerance,
        T_last_flange: Floats | None = None,
        T_base_first: Floats | None = None,
    ) -> None:
        n = len(links)
        self._nominal = nominal_rows(links)
        self._T_last_flange = np.eye(4) if T_last_flange is None else T_last_flange
        self._T_base_first = np.eye(4) if T_base_first is None else T_base_first
        self._twist_flange_last = adjoint(inverse(self._T_last_flange))
        parameters = tuple(p for i, k in enumerate(links, start=1) for p in row_parameters(i, i, k, tolerance))
        super().__init__(n, parameters, tuple(frame for i in range(n) for frame in (i, i, i + 1, i + 1, i + 1)))

    def link_tail(self, theta: Floats) -> Floats:
        """(joint, 4, 4) constant part of each link: Tz Tx Rx Ry multiplied out, the last one with the flange."""
        _, d, a, alpha, tilt = (self._nominal + theta.reshape(-1, PER_LINK)).T
        ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(tilt), np.sin(tilt)
        out = np.zeros((self.n_joints, 4, 4))
        out[:, 0, 0], out[:, 0, 2], out[:, 0, 3] = cb, sb, a
        out[:, 1, 0], out[:, 1, 1], out[:, 1, 2] = sa * sb, ca, -sa * cb
        out[:, 2, 0], out[:, 2, 1], out[:, 2, 2], out[:, 2, 3] = -ca * sb, sa, ca * cb, d
        out[:, 3, 3] = 1.0
        out[-1] = out[-1] @ self._T_last_flange
        return out

    def fixed_parts(self, theta: Floats) -> Floats:
        return np.concatenate([self._T_base_first[None], self.link_tail(theta)])

    def angle_offset_rad(self, theta: Floats) -> Floats:
        return self._nominal[:, 0] + theta[::PER_LINK]

    def body_twists(self, theta: Floats) -> Floats:
        """Zero and offset act along z in front of the turn, the others at the end of the link."""
        tilt = theta[4::PER_LINK]
        out = np.zeros((self.n_joints, PER_LINK, 6))
        out[:, 0, 5] = 1.0
        out[:, 1, 2] = 1.0
        out[:, 2, 0], out[:, 2, 2] = np.cos(tilt), np.sin(tilt)  # x in front of the tilt, seen from behind it
        out[:, 3, 3:] = out[:, 2, :3]
        out[:, 4, 4] = 1.0
        out[-1, 2:] = out[-1, 2:] @ self._twist_flange_last.T
        return out.reshape(-1, 6)


def nominal_rows(links: tuple[DhLink, ...]) -> Floats:
    """(joint, 5) theta offset, d, a, alpha and the tilt, which no drawing has."""
    return np.array([[k.theta_offset_rad, k.d_m, k.a_m, k.alpha_rad, 0.0] for k in links])


def near_parallel(alpha_rad: float) -> bool:
    """Whether a tilt between axes that cross at this twist is something of its own."""
    return abs(math.cos(alpha_rad)) > PARALLEL_COSINE


def row_parameters(i: int, body: int, row: DhLink, tolerance: LinkTolerance) -> tuple[Parameter, ...]:
    """Of row i, whose length, twist and tilt are those of link `body`."""
    return (
        zero_parameter(i),
        link_length(f"link{i}.offset", tolerance),
        link_length(f"link{body}.length", tolerance),
        link_angle(f"link{body}.twist", tolerance),
        link_angle(f"link{body}.tilt", tolerance, own=near_parallel(row.alpha_rad)),
    )
