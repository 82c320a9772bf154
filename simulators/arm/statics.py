"""What weight does to an arm at rest: moments at the start of every link.

Sum over all masses beyond: moment = sum (c - o) x m g, force = sum m g (statics of a chain cut open; any mechanics
text).
"""

from collections.abc import Sequence
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
    beyond_nm: Floats  # (row, n + 1, 3) as moment_nm, without the body that turns with joint i itself
    beyond_n: Floats  # (row, n + 1, 3) its weight
    down_flange: Floats  # (row, 3) direction of gravity in the flange frame
    frames: Frames  # where the arm stands
    gravity_m_s2: Floats  # (3,) in the base frame
    arm: Arm | None = None  # what is weighed, for loads on the way between samples; None in the moving world


def weigh(arm: Arm, frames: Frames, foot: Floats, payload_kg: Floats, payload_com_m: Floats) -> Load:
    """The load of each sample; `foot` (row, 4, 4) is the frame of link 0.

    `payload_com_m` (3,) or (row, 3) in the flange frame.
    """
    rows, n = frames.turning.shape[:2]
    turn, origin_m = frames.turning[..., :3, :3], frames.turning[..., :3, 3]
    centre_m = np.einsum("rnij,nj->rni", turn, arm.com_m) + origin_m
    flange_turn, flange_m = frames.flange[:, :3, :3], frames.flange[:, :3, 3]
    carried_at_m = _in_base(flange_turn, flange_m, payload_com_m)
    held_m = arm.tool_kg * (flange_turn @ arm.tool_com_m + flange_m) + payload_kg[:, np.newaxis] * carried_at_m
    by_gravity = np.cross(np.eye(3), arm.gravity_m_s2)  # v @ by_gravity is v x g
    start_m = np.concatenate((foot[:, np.newaxis, :3, 3], origin_m), axis=1)
    axes = np.concatenate((foot[:, np.newaxis, :3, :3], turn), axis=1)
    bodies_kg = np.concatenate(((arm.tool_kg + payload_kg)[:, np.newaxis], np.tile(arm.mass_kg, (rows, 1))[:, ::-1]), 1)
    bodies_m = np.concatenate((held_m[:, np.newaxis], (arm.mass_kg[:, np.newaxis] * centre_m)[:, ::-1]), axis=1)
    beyond_kg, first_m = (np.cumsum(each, axis=1)[:, ::-1] for each in (bodies_kg, bodies_m))  # without the own body

    def about(kg: Floats, first_m: Floats) -> tuple[Floats, Floats]:
        about_start = (first_m - kg[..., np.newaxis] * start_m) @ by_gravity
        return (
            np.einsum("rnji,rnj->rni", axes, about_start),
            np.einsum("rnji,rnj->rni", axes, kg[..., np.newaxis] * arm.gravity_m_s2),
        )

    own = np.maximum(np.arange(n + 1) - 1, 0)  # with the own body: all beyond the start of the link before
    beyond, weight = about(beyond_kg, first_m)
    moment, force = about(beyond_kg[:, own], first_m[:, own])
    carried_m = carried_at_m[:, np.newaxis] - origin_m
    carried_nm = payload_kg[:, np.newaxis, np.newaxis] * (carried_m @ by_gravity)
    payload_torque_nm = np.einsum("rni,rni->rn", carried_nm, turn[..., 2])
    down = arm.gravity_m_s2 / max(float(np.linalg.norm(arm.gravity_m_s2)), 1e-12)
    return Load(
        moment[:, 1:, 2].copy(),
        payload_torque_nm,
        moment,
        force,
        beyond,
        weight,
        np.einsum("rji,j->ri", flange_turn, down),
        frames,
        arm.gravity_m_s2,
        arm,
    )


def _in_base(turn: Floats, origin_m: Floats, point_m: Floats) -> Floats:
    """(row, 3) of a point (3,) or (row, 3) of a frame."""
    return np.einsum("rij,rj->ri", turn, np.broadcast_to(point_m, origin_m.shape)) + origin_m


@dataclass(frozen=True)
class Weight:
    """A body that turns with joint `body` (0: it stands on the foot), times the compliance of what it loads.

    So its mass is in kg rad/Nm, and its first moment about the start of that link in kg m rad/Nm: what a spring of
    known deflection under weights that nobody has put on a balance is.
    """

    body: int
    mass: float
    moment: tuple[float, float, float]


def carried_by(load: Load, mass_kg: Floats, point_m: Floats, link: int) -> tuple[Floats, Floats]:
    """As `loaded_by`, of masses (row,) at a point (3,) or (row, 3) of the flange."""
    turn, origin_m = load.frames.flange[:, :3, :3], load.frames.flange[:, :3, 3]
    axes = load.frames.turning[:, link - 1] if link else np.broadcast_to(np.eye(4), load.frames.flange.shape)
    force = mass_kg[:, np.newaxis] * load.gravity_m_s2
    moment = np.cross(_in_base(turn, origin_m, point_m) - axes[:, :3, 3], force)
    back = axes[:, :3, :3]
    return np.einsum("rji,rj->ri", back, moment), np.einsum("rji,rj->ri", back, force)


def loaded_by(load: Load, weights: Sequence[Weight], link: int) -> tuple[Floats, Floats]:
    """Moment about the start of link `link` and force, each (row, 3), in that link's frame, of the weights beyond."""
    turn, origin_m = load.frames.turning[..., :3, :3], load.frames.turning[..., :3, 3]
    rows = len(turn)
    start_m = np.zeros((rows, 3)) if link == 0 else origin_m[:, link - 1]
    moment, force = np.zeros((rows, 3)), np.zeros((rows, 3))
    for weight in weights:
        if weight.body >= max(link, 1):
            own = turn[:, weight.body - 1] @ np.asarray(weight.moment)
            lever = own + weight.mass * (origin_m[:, weight.body - 1] - start_m)
            moment += np.cross(lever, load.gravity_m_s2)
            force += weight.mass * load.gravity_m_s2
    if link == 0:
        return moment, force
    axes = turn[:, link - 1]
    return np.einsum("rji,rj->ri", axes, moment), np.einsum("rji,rj->ri", axes, force)
