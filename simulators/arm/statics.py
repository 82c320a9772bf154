"""What weight does to an arm at rest: moments at the start of every link.

Sum over all masses beyond: moment = sum (c - o) x m g, force = sum m g (statics of a chain cut open; any mechanics
text).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Load:
    """What weight does to the arm, in its true pose and with its true masses."""

    torque_nm: Floats  # (row, n) of gravity about each joint's positive axis
    payload_torque_nm: Floats  # (row, n) the payload's share of it
    moment_nm: Floats  # (row, n + 1, 3) of all weight beyond the start of link i, about that start, in link i's frame
    force_n: Floats  # (row, n + 1, 3) the weight itself, same frame
    down_flange: Floats  # (row, 3) direction of gravity in the flange frame


def weigh(arm: Arm, frames: Frames, foot: Floats, payload_kg: Floats, payload_com_m: Floats) -> Load:
    """The load of each sample; `foot` (row, 4, 4) is the frame of link 0, `payload_com_m` (3,) in the flange frame."""
    rows, n = frames.turning.shape[:2]
    turn, origin_m = frames.turning[..., :3, :3], frames.turning[..., :3, 3]
    centre_m = np.einsum("rnij,nj->rni", turn, arm.com_m) + origin_m
    flange_turn, flange_m = frames.flange[:, :3, :3], frames.flange[:, :3, 3]
    beyond_kg = arm.tool_kg + payload_kg
    first_m = arm.tool_kg * (flange_turn @ arm.tool_com_m + flange_m) + payload_kg[:, np.newaxis] * (
        flange_turn @ payload_com_m + flange_m
    )
    by_gravity = np.cross(np.eye(3), arm.gravity_m_s2)  # v @ by_gravity is v x g
    moment = np.empty((rows, n + 1, 3))
    force = np.empty((rows, n + 1, 3))
    for link in range(n, -1, -1):
        if link > 0:
            beyond_kg = beyond_kg + arm.mass_kg[link - 1]
            first_m = first_m + arm.mass_kg[link - 1] * centre_m[:, link - 1]
            start_m, axes = origin_m[:, link - 1], turn[:, link - 1]
        else:
            start_m, axes = foot[:, :3, 3], foot[:, :3, :3]
        about_start = (first_m - beyond_kg[:, np.newaxis] * start_m) @ by_gravity
        moment[:, link] = np.einsum("rji,rj->ri", axes, about_start)
        force[:, link] = np.einsum("rji,rj->ri", axes, beyond_kg[:, np.newaxis] * arm.gravity_m_s2)
    carried_m = (flange_turn @ payload_com_m + flange_m)[:, np.newaxis] - origin_m
    carried_nm = payload_kg[:, np.newaxis, np.newaxis] * (carried_m @ by_gravity)
    payload_torque_nm = np.einsum("rni,rni->rn", carried_nm, turn[..., 2])
    down = arm.gravity_m_s2 / max(float(np.linalg.norm(arm.gravity_m_s2)), 1e-12)
    return Load(moment[:, 1:, 2].copy(), payload_torque_nm, moment, force, np.einsum("rji,j->ri", flange_turn, down))
