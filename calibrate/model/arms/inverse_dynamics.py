"""Torques of a rigid arm in motion, linear in the inertial parameters of its links.

Of link i, which turns with joint i, ten numbers in the axes of B_i and about its origin: mass (kg), first moments m c
(kg m), and the inertia tensor xx, yy, zz, xy, xz, yz (kg m²). The acceleration of the base stands for gravity.
Source: Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, sections 9.3 and 12.4 (Newton-Euler
equations, linear in these parameters; which combinations of them a motion shows at all: base parameters).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.model.rigid import cross_matrix

Floats = NDArray[np.float64]
NUMBERS = ("mass", "mx", "my", "mz", "ixx", "iyy", "izz", "ixy", "ixz", "iyz")
UNITS = ("kg", *("kg m",) * 3, *("kg m^2",) * 6)


def torque_columns(frames: Floats, qd_rad_s: Floats, qdd_rad_s2: Floats, gravity_m_s2: Floats) -> Floats:
    """(row, joint, link, 10) torque at each joint (Nm) for one unit of each number of each link.

    `frames` (row, joint + 1, 4, 4) B_0 ... B_n, of which B_n is fixed to the last link; speeds and accelerations (row,
    joint) of the joints, `gravity_m_s2` (3,) in the base.
    """
    rows, n = qd_rad_s.shape
    out = np.zeros((rows, n, n, len(NUMBERS)))
    axis, at = frames[:, :-1, :3, 2], frames[:, :-1, :3, 3]
    for link, (force, moment) in enumerate(_wrenches(frames, qd_rad_s, qdd_rad_s2, gravity_m_s2)):
        for joint in range(link + 1):
            arm = cross_matrix(frames[:, link + 1, :3, 3] - at[:, joint])
            out[:, joint, link] = np.einsum("rk,rkp->rp", axis[:, joint], moment + arm @ force)
    return out


def _wrenches(frames: Floats, qd: Floats, qdd: Floats, gravity: Floats) -> Iterator[tuple[Floats, Floats]]:
    """Of each link what moves it: force (row, 3, 10) and moment about the origin of B_i (row, 3, 10), in the base."""
    speed = np.zeros((len(qd), 3))
    turning = np.zeros_like(speed)
    origin = np.broadcast_to(-gravity, speed.shape)
    for i in range(qd.shape[1]):
        axis = frames[:, i, :3, 2]
        turning = turning + axis * qdd[:, i, None] + np.cross(speed, axis * qd[:, i, None])
        speed = speed + axis * qd[:, i, None]
        reach = frames[:, i + 1, :3, 3] - frames[:, i, :3, 3]
        origin = origin + np.cross(turning, reach) + np.cross(speed, np.cross(speed, reach))
        R = frames[:, i + 1, :3, :3]
        spin = cross_matrix(speed)
        force, moment = np.zeros((len(qd), 3, len(NUMBERS))), np.zeros((len(qd), 3, len(NUMBERS)))
        force[:, :, 0] = origin
        force[:, :, 1:4] = (cross_matrix(turning) + spin @ spin) @ R
        moment[:, :, 1:4] = -cross_matrix(origin) @ R
        own_speed, own_turning = np.einsum("rji,rj->ri", R, speed), np.einsum("rji,rj->ri", R, turning)
        moment[:, :, 4:] = R @ (_by_tensor(own_turning) + cross_matrix(own_speed) @ _by_tensor(own_speed))
        yield force, moment


def _by_tensor(v: Floats) -> Floats:
    """(row, 3, 6) derivative of I v by xx, yy, zz, xy, xz, yz, for v (row, 3)."""
    x, y, z = v.T
    zero = np.zeros_like(x)
    rows = ((x, zero, zero, y, z, zero), (zero, y, zero, x, zero, z), (zero, zero, z, zero, x, y))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)
