"""Moments of weight: about every joint axis, about the base, in every link; of stated masses and of unknown ones.

Of unknown masses a moment is linear in each link's mass and first moment (Atkeson, An, Hollerbach, Estimation of
Inertial Parameters of Manipulator Loads and Links, Int. J. Robotics Research 5(3), 1986). Only what differs over the
session's poses can be told apart, so those columns are reduced to their strongest combinations.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.effects.drivers import Drivers
from calibrate.effects.time_laws import varies
from calibrate.rigid import cross

Floats = NDArray[np.float64]

FIRST_MOMENT_M = 0.1  # a link's centre of mass is about this far from its frame: scales columns only
STRONGEST = 4  # combinations of unknown masses at a joint
WEAKEST = 0.03  # of the strongest: below, a combination is not worth its column
UPRIGHT = 0.02  # sine of the angle below which an axis along gravity turns nothing against it
KEPT = 64  # sessions and joints whose columns are remembered


@lru_cache(maxsize=KEPT)
def stated_torque_nm(drivers: Drivers, joint: int) -> Floats:
    """(pose,) about the axis of a joint (from 1), of stated masses behind it and the payload."""
    rig = drivers.rig
    links = rig.arm.joints[joint - 1 :]
    total = np.zeros(len(drivers.q_rad))
    for i, link in enumerate(links, start=joint):
        if link.mass_kg:
            total += _torque(drivers, joint, link.mass_kg, point_of(drivers, i, link.com_m or (0.0, 0.0, 0.0)))
    if rig.tool.mass_kg:
        com = rig.tool.com_m or (0.0, 0.0, 0.0)
        total += _torque(drivers, joint, rig.tool.mass_kg, point_of(drivers, drivers.n_joints, com))
    if drivers.payload_kg is not None:
        total += drivers.payload_kg * payload_levers(drivers, joint)[:, 0]
    return total


@lru_cache(maxsize=KEPT)
def likely_torque_nm(drivers: Drivers, joint: int) -> Floats:
    """(pose,) as stated_torque_nm; where no mass is stated, of one kilogram at each frame: its sign, not its size."""
    if any(i >= joint for _, i, _ in _stated(drivers)):
        return stated_torque_nm(drivers, joint)
    each = [_torque(drivers, joint, 1.0, drivers.frames[:, i, :3, 3]) for i in range(joint, drivers.n_joints + 1)]
    return np.sum(each, axis=0)


def loaded(drivers: Drivers, joint: int) -> bool:
    """Whether the rig states masses behind a joint (from 1) that turn it differently from pose to pose."""
    rig = drivers.rig
    stated = rig.tool.mass_kg is not None or any(link.mass_kg is not None for link in rig.arm.joints[joint - 1 :])
    return stated and varies(stated_torque_nm(drivers, joint))


@lru_cache(maxsize=KEPT)
def unknown_torques(drivers: Drivers, joint: int) -> Floats:
    """(pose, m) strongest combinations of the moments that unknown masses make about a joint, each of rms 1."""
    columns: list[Floats] = []
    for i in range(joint, drivers.n_joints + 1):
        frame, g = drivers.frames[:, i], drivers.gravity_m_s2
        columns.append(_torque(drivers, joint, 1.0, frame[:, :3, 3]))
        axis = drivers.frames[:, joint - 1, :3, 2]
        columns += [FIRST_MOMENT_M * np.einsum("nj,nj->n", axis, cross(frame[:, :3, k], g[None])) for k in range(3)]
    return strongest(np.stack(columns, axis=1))


def payload_levers(drivers: Drivers, joint: int) -> Floats:
    """(pose, 1) torque of 1 kg at the payload's stated centre of mass; (pose, 4) at the flange origin and by first
    moments of 1 kg m, where the centre is not stated.
    """
    flange, g = drivers.frames[:, -1], drivers.gravity_m_s2
    if drivers.payload_com_m is not None:
        return _torque(drivers, joint, 1.0, _payload_at_m(drivers))[:, None]
    axis = drivers.frames[:, joint - 1, :3, 2]
    moments = [np.einsum("nj,nj->n", axis, cross(flange[:, :3, k], g[None])) for k in range(3)]
    return np.stack([_torque(drivers, joint, 1.0, flange[:, :3, 3]), *moments], axis=1)


def _payload_at_m(drivers: Drivers) -> Floats:
    """(pose, 3) in the base; the flange where the payload's centre is not stated."""
    flange = drivers.frames[:, -1]
    if drivers.payload_com_m is None:
        return flange[:, :3, 3]
    return flange[:, :3, 3] + np.einsum("nij,nj->ni", flange[:, :3, :3], drivers.payload_com_m)


def gravity_in_flange(drivers: Drivers) -> Floats:
    """(pose, 3) unit vector in the flange's axes; zero where the rig stands in no gravity."""
    g = drivers.gravity_m_s2
    return np.einsum("nji,j->ni", drivers.frames[:, -1, :3, :3], g / max(float(np.linalg.norm(g)), 1e-9))


def turning_joints(drivers: Drivers) -> str:
    """Joints, joined by commas, that turn the flange against gravity: "q2,q3,q4,q5"."""
    axes = drivers.frames[:, :-1, :3, 2]
    across = np.linalg.norm(np.cross(axes, drivers.gravity_m_s2), axis=2).max(axis=0)
    upright = across < UPRIGHT * max(float(np.linalg.norm(drivers.gravity_m_s2)), 1e-9)
    return ",".join(f"q{joint}" for joint, idle in enumerate(upright.tolist(), start=1) if not idle)


def point_of(drivers: Drivers, frame: int, point_m: tuple[float, float, float]) -> Floats:
    """(pose, 3) in the base of a point fixed in B_frame."""
    B = drivers.frames[:, frame]
    return B[:, :3, :3] @ np.array(point_m) + B[:, :3, 3]


def masses(drivers: Drivers) -> list[tuple[float, int, tuple[float, float, float]]]:
    """Mass (kg), frame and centre of every link and the tool; where none is stated, one kilogram at each frame."""
    return _stated(drivers) or [(1.0, i, (0.0, 0.0, 0.0)) for i in range(1, drivers.n_joints + 1)]


def _stated(drivers: Drivers) -> list[tuple[float, int, tuple[float, float, float]]]:
    rig = drivers.rig
    stated = [
        (link.mass_kg, i, link.com_m or (0.0, 0.0, 0.0))
        for i, link in enumerate(rig.arm.joints, start=1)
        if link.mass_kg
    ]
    if rig.tool.mass_kg:
        stated.append((rig.tool.mass_kg, drivers.n_joints, rig.tool.com_m or (0.0, 0.0, 0.0)))
    return stated


@lru_cache(maxsize=KEPT)
def moment_behind_nm(drivers: Drivers, frame: int) -> Floats:
    """(pose, 3) moment, about the origin of B_frame and in its axes, of all weight behind it; payload included."""
    B = drivers.frames[:, frame]
    total = np.zeros((len(B), 3))
    for mass, i, com in masses(drivers):
        if i > frame:
            total += cross(point_of(drivers, i, com) - B[:, :3, 3], mass * drivers.gravity_m_s2[None])
    if drivers.payload_kg is not None:
        weight = drivers.payload_kg[:, None] * drivers.gravity_m_s2
        total += cross(_payload_at_m(drivers) - B[:, :3, 3], weight)
    return np.einsum("nji,nj->ni", B[:, :3, :3], total)


@lru_cache(maxsize=KEPT)
def weight_behind_n(drivers: Drivers, frame: int) -> Floats:
    """(pose, 3) force in the axes of B_frame of all weight behind it; payload included."""
    carried = np.full(len(drivers.t_s), sum(mass for mass, i, _ in masses(drivers) if i > frame))
    if drivers.payload_kg is not None:
        carried += drivers.payload_kg
    turned = np.einsum("nji,j->ni", drivers.frames[:, frame, :3, :3], drivers.gravity_m_s2)
    return carried[:, None] * turned


@lru_cache(maxsize=KEPT)
def overturning_nm(drivers: Drivers) -> Floats:
    """(pose, 3) moment of all weight about the base origin, in the base."""
    total = np.zeros((len(drivers.q_rad), 3))
    for mass, i, com in masses(drivers):
        total += cross(point_of(drivers, i, com), mass * drivers.gravity_m_s2[None])
    if drivers.payload_kg is not None:
        total += cross(_payload_at_m(drivers), drivers.payload_kg[:, None] * drivers.gravity_m_s2)
    return total


def strongest(columns: Floats, most: int = STRONGEST) -> Floats:
    """(pose, m) principal combinations, each of rms 1; none where all are zero."""
    U, s, _ = np.linalg.svd(columns, full_matrices=False)
    if s[0] <= 1e-9 * np.sqrt(len(columns)):
        return np.zeros((len(columns), 0))
    kept = int(np.sum(s[:most] > WEAKEST * s[0]))
    return U[:, :kept] * np.sqrt(len(columns))


def _torque(drivers: Drivers, joint: int, mass_kg: float, at_m: Floats) -> Floats:
    before = drivers.frames[:, joint - 1]
    lever = at_m - before[:, :3, 3]
    return mass_kg * np.einsum("nj,nj->n", before[:, :3, 2], cross(lever, drivers.gravity_m_s2[None]))
