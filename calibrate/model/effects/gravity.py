"""Moments of weight about joint axes, about the base, in links; of any loads (calibrate/model/effects/loads.py)."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.loads import (
    Load,
    carried,
    load_at,
    payload,
    stated_masses,
    states_masses,
)
from calibrate.model.effects.time_laws import varies
from calibrate.model.rigid import cross

Floats = NDArray[np.float64]

UPRIGHT = 0.02  # sine of the angle below which an axis along gravity turns nothing against it
KEPT = 64  # sessions and joints whose columns are remembered


def torques_nm(drivers: Drivers, joint: int, loads: Sequence[Load]) -> Floats:
    """(pose, load) about the axis of a joint (from 1); zero of what hangs before it."""
    before, g = drivers.frames[:, joint - 1], drivers.gravity_m_s2
    turning = cross(g[None], before[:, :3, 2])  # axis . (first moment x g) = first moment . (g x axis)
    out = np.zeros((len(before), len(loads)))
    for k, load in enumerate(loads):
        if load.frame >= joint:
            out[:, k] = np.einsum("nj,nj->n", _first_moment(drivers, before[:, :3, 3], load), turning)
    return out


def bending_nm(drivers: Drivers, frame: int, loads: Sequence[Load]) -> Floats:
    """(pose, 3, load) moment about the origin of B_frame, in its axes; zero of what hangs before it."""
    B = drivers.frames[:, frame]
    behind = np.array([load.frame > frame for load in loads])
    moments = _moments_nm(drivers, B[:, :3, 3], loads) * behind
    return np.swapaxes(B[:, :3, :3], 1, 2) @ moments


def weights_n(drivers: Drivers, frame: int, loads: Sequence[Load]) -> Floats:
    """(pose, 3, load) force in the axes of B_frame of what hangs behind it."""
    down = np.einsum("nji,j->ni", drivers.frames[:, frame, :3, :3], drivers.gravity_m_s2)
    zero = np.zeros(len(down))
    masses_kg = np.stack([zero + (load.mass_kg if load.frame > frame else 0.0) for load in loads], axis=1)
    return down[:, :, None] * masses_kg[:, None, :]


@lru_cache(maxsize=KEPT)
def stated_torque_nm(drivers: Drivers, joint: int) -> Floats:
    """(pose,) about the axis of a joint (from 1), of stated masses behind it and the payload."""
    return torques_nm(drivers, joint, carried(drivers)).sum(axis=1)


@lru_cache(maxsize=KEPT)
def likely_torque_nm(drivers: Drivers, joint: int) -> Floats:
    """(pose,) as stated_torque_nm; where no mass is stated, of one kilogram at each frame: its sign, not its size."""
    if states_masses(drivers.rig):
        return stated_torque_nm(drivers, joint)
    ones = [load_at(i, 1.0, (0.0, 0.0, 0.0)) for i in range(joint, drivers.n_joints + 1)]
    return torques_nm(drivers, joint, ones).sum(axis=1)


def loaded(drivers: Drivers, joint: int) -> bool:
    """Whether the rig states masses behind a joint (from 1) that turn it differently from pose to pose."""
    return any(link.mass_kg is not None for link in drivers.rig.arm.joints[joint - 1 :]) and varies(
        stated_torque_nm(drivers, joint)
    )


def payload_levers(drivers: Drivers, joint: int) -> Floats:
    """(pose, 1) torque of 1 kg at the payload's stated centre of mass; (pose, 4) at the flange origin and by first
    moments of 1 kg m, where the centre is not stated.
    """
    at, one = drivers.n_joints, np.array(1.0)
    if drivers.payload_com_m is not None:
        return torques_nm(drivers, joint, [Load(at, one, drivers.payload_com_m)])
    moments = [Load(at, np.array(0.0), axis) for axis in np.eye(3)]
    return torques_nm(drivers, joint, [Load(at, one, np.zeros(3)), *moments])


def gravity_in_flange(drivers: Drivers) -> Floats:
    """(pose, 3) unit vector in the flange's axes; zero where the rig stands in no gravity."""
    g = drivers.gravity_m_s2
    return np.einsum("nji,j->ni", drivers.frames[:, -1, :3, :3], g / max(float(np.linalg.norm(g)), 1e-9))


def turning_joints(drivers: Drivers) -> str:
    """Joints, joined by commas, that turn the flange against gravity: "q2,q3,q4,q5"."""
    return ",".join(f"q{joint}" for joint in range(1, drivers.n_joints + 1) if not upright(drivers, joint))


def upright(drivers: Drivers, joint: int) -> bool:
    """Whether the axis of a joint (from 1) stays along gravity, whose moment about it is but that of a tilted foot."""
    across = np.linalg.norm(np.cross(drivers.frames[:, joint - 1, :3, 2], drivers.gravity_m_s2), axis=1)
    return bool(across.max() < UPRIGHT * max(float(np.linalg.norm(drivers.gravity_m_s2)), 1e-9))


def point_of(drivers: Drivers, frame: int, point_m: tuple[float, float, float]) -> Floats:
    """(pose, 3) in the base of a point fixed in B_frame."""
    B = drivers.frames[:, frame]
    return B[:, :3, :3] @ np.array(point_m) + B[:, :3, 3]


def masses(drivers: Drivers) -> list[tuple[float, int, tuple[float, float, float]]]:
    """Mass (kg), frame and centre of every link and the tool; where none is stated, one kilogram at each frame."""
    if states_masses(drivers.rig):
        return stated_masses(drivers)
    return [(1.0, i, (0.0, 0.0, 0.0)) for i in range(1, drivers.n_joints + 1)]


@lru_cache(maxsize=KEPT)
def overturning_nm(drivers: Drivers) -> Floats:
    """(pose, 3) moment of all weight about the base origin, in the base; where none is stated, by `masses`."""
    loads = [load_at(i, mass, com) for mass, i, com in masses(drivers)]
    if drivers.payload_kg is not None:
        loads.append(payload(drivers, drivers.payload_kg))
    return overturning_by(drivers, loads).sum(axis=2)


def overturning_by(drivers: Drivers, loads: Sequence[Load]) -> Floats:
    """(pose, 3, load) moment of each load about the base origin, in the base."""
    return _moments_nm(drivers, np.zeros((len(drivers.frames), 3)), loads)


def _moments_nm(drivers: Drivers, about_m: Floats, loads: Sequence[Load]) -> Floats:
    """(pose, 3, load) of the weight of each load about points (pose, 3), in the base."""
    g = drivers.gravity_m_s2[None]
    return np.stack([cross(_first_moment(drivers, about_m, load), g) for load in loads], axis=2)


def _first_moment(drivers: Drivers, about_m: Floats, load: Load) -> Floats:
    """(pose, 3) of a load about points (pose, 3), in the base's axes."""
    B = drivers.frames[:, load.frame]
    own = np.einsum("nij,nj->ni", B[:, :3, :3], np.broadcast_to(load.moment_kg_m, (len(B), 3)))
    return own + load.mass_kg[..., None] * (B[:, :3, 3] - about_m)
