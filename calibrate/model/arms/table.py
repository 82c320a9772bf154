"""From the axes of any serial arm to a D-H table: common normals, and Hayati's tilt between near-parallel axes.

A frame whose z is a joint's axis may be slid along and turned about it without changing the motion of the arm. The
table uses this freedom: frame i is put on axis i+1 where the common normal with axis i meets it. Sources: Denavit,
Hartenberg, J. Appl. Mech. 22, 1955; Hayati, Mirmirani, J. Robotic Systems 2(4), 1985 (near-parallel axes: the plane
normal to axis i through a point of axis i+1 instead of the common normal, which runs away there).
"""

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.arms.dh import DhLink
from calibrate.model.arms.serial import (
    rotation_x,
    rotation_y,
    rotation_z,
    shift,
)
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]

# Sine between axes that are meant to be parallel: 3 deg. Bad assembly stays far below, a drawn angle far above.
NEAR_PARALLEL_SINE = 0.05
# Here the foot of a common normal of 1 m lies 1e7 m away: its rounding (1e-9 m) and the angle's are alike.
PARALLEL_SINE = 1e-7
ON_THE_AXIS_M = 1e-9  # a common normal shorter than this has no direction of its own


class NearParallel(enum.Enum):
    """What a table does with axes that are parallel but for a small error."""

    TILT = "Hayati's extra angle beside the four of the table"
    COMMON_NORMAL = "four numbers only; the offsets of such axes run to metres or kilometres"
    AS_PARALLEL = "four numbers only, the small angle is dropped and its error stays"


@dataclass(frozen=True)
class Table:
    """T_base_flange(q) = T_base_first T_1 ... T_n T_last_flange with T_i as in arms/dh.py."""

    T_base_first: Floats
    rows: tuple[DhLink, ...]
    tilt_rad: tuple[float, ...]  # (joint,) behind each row
    T_last_flange: Floats


def dh_table(parts: Floats, near_parallel: NearParallel = NearParallel.TILT, like: Table | None = None) -> Table:
    """The D-H table of the arm F_0 Rz(q_1) F_1 ... Rz(q_n) F_n, parts (joint + 1, 4, 4); offsets are in the parts.

    `like`: the table of a near arm; the first frame is turned as there, and of the two
    senses of a common normal that of this table is taken.
    """
    n = len(parts) - 1
    near = (0.0,) * n if like is None else [row.theta_offset_rad for row in like.rows]
    first = np.eye(3) if like is None else like.T_base_first[:3, :3]
    own = _slid_towards(first, parts[0])  # own frame of axis i, given in B_(i-1): a slide along and turn about z
    T_base_first = parts[0] @ own
    rows: list[DhLink] = []
    tilts: list[float] = []
    for i in range(1, n + 1):
        T_own_next = inverse(own) @ parts[i]
        row, tilt = _row(T_own_next, near_parallel, near[i - 1]) if i < n else (_last_row(T_own_next), 0.0)
        rows.append(row)
        tilts.append(0.0 if near_parallel is NearParallel.AS_PARALLEL else tilt)
        own = inverse(parts[i]) @ own @ _tail(row, tilt)
    return Table(T_base_first, tuple(rows), tuple(tilts), inverse(own))


def _slid_towards(R_base_first: Floats, T_base_axis: Floats) -> Floats:
    """Slide and turn that bring a frame on axis 1 as near to the base origin and this orientation as they can."""
    R = R_base_first.T @ T_base_axis[:3, :3]
    turn = math.atan2(R[0, 1] - R[1, 0], R[0, 0] + R[1, 1])  # largest trace of R Rz(turn)
    slid = -float(T_base_axis[:3, 2] @ T_base_axis[:3, 3])  # to the foot of the base origin on the axis
    return shift(0.0, slid) @ rotation_z(turn)


def _row(T_own_next: Floats, near_parallel: NearParallel, near: float) -> tuple[DhLink, float]:
    """Row and tilt that lead from z of a frame to the axis z of another one given in it."""
    point_m, axis = T_own_next[:3, 3], T_own_next[:3, 2]
    sine = math.hypot(axis[0], axis[1])
    if sine > (PARALLEL_SINE if near_parallel is NearParallel.COMMON_NORMAL else NEAR_PARALLEL_SINE):
        return _by_common_normal(point_m, axis, near), 0.0
    row, tilt = _by_normal_plane(point_m, axis, near)
    return row, 0.0 if near_parallel is NearParallel.COMMON_NORMAL else tilt


def _by_common_normal(point_m: Floats, axis: Floats, near: float) -> DhLink:
    """The axis z and a line that is not parallel to it."""
    normal = np.array([-axis[1], axis[0]]) / math.hypot(axis[0], axis[1])  # of z x axis; its third part is zero
    theta = _nearer_half(math.atan2(normal[1], normal[0]), near)
    c, s = math.cos(theta), math.sin(theta)
    across = -s * axis[0] + c * axis[1]  # part of the axis along y, once x is the normal
    along = (-s * point_m[0] + c * point_m[1]) / across  # from the point back to the foot, in units of the axis
    d = float(point_m[2] - along * axis[2])
    return DhLink(theta, d, float(c * point_m[0] + s * point_m[1]), math.atan2(-across, axis[2]))


def _by_normal_plane(point_m: Floats, axis: Floats, near: float) -> tuple[DhLink, float]:
    """The axis z and a line near-parallel to it that passes the plane normal to z at the given point."""
    length = math.hypot(point_m[0], point_m[1])
    theta = _nearer_half(math.atan2(point_m[1], point_m[0]), near) if length > ON_THE_AXIS_M else 0.0
    c, s = math.cos(theta), math.sin(theta)
    x, y = c * axis[0] + s * axis[1], -s * axis[0] + c * axis[1]
    a = float(c * point_m[0] + s * point_m[1])
    return DhLink(theta, float(point_m[2]), a, math.atan2(-y, axis[2])), math.asin(max(-1.0, min(1.0, x)))


def _last_row(T_own_flange: Floats) -> DhLink:
    """Nothing turns behind the last row: it takes x and z of the flange, the flange transform the rest."""
    x, axis, point_m = T_own_flange[:3, 0], T_own_flange[:3, 2], T_own_flange[:3, 3]
    theta = math.atan2(x[1], x[0])
    c, s = math.cos(theta), math.sin(theta)
    alpha = math.atan2(s * axis[0] - c * axis[1], axis[2])
    return DhLink(theta, float(point_m[2]), float(c * point_m[0] + s * point_m[1]), alpha)


def _nearer_half(theta: float, near: float) -> float:
    """The direction of a normal, of its two signs the one nearer to an angle; 0 is the present x."""
    apart = math.remainder(theta - near, math.tau)
    if apart > math.pi / 2 + 1e-12:
        return near + apart - math.pi
    return near + apart + math.pi if apart < -math.pi / 2 + 1e-12 else near + apart


def _tail(row: DhLink, tilt: float) -> Floats:
    """Rz Tz Tx Rx Ry of a row at joint angle zero."""
    behind = shift(row.a_m, row.d_m) @ rotation_x(row.alpha_rad) @ rotation_y(tilt)
    return rotation_z(row.theta_offset_rad) @ behind
