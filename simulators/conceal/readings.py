"""The whole chain with its hidden mechanisms, and the reading of a rig's instrument without noise: (row, channel) in m.

The chain is in order of the signal: shaft, joint, links, tool, instrument. Each defect acts where it has a method (see
`defects.defect`). Weight and deflection depend on each other: the arm's pose is iterated until it carries its own
weight.

dual-psd: psd1 x, y, psd2 x, y. position: x, y, z in the device frame. wire: length. seat: where the joint readings
place the probe against its cone, x, y, z in the base frame (the readings themselves are the joint angles).

The beam on both faces: in a sensor frame the face is z = 0, the beam meets it at o - d (o_z / d_z), and a mirror turns
d_z about (law of reflection). The cosines and the power share of each face follow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, Frames, forward, inverse, shifted
from simulators.arm.statics import Load, weigh
from simulators.conceal.rig import Device, DualPsd, TrueRig
from simulators.defects import Light, Scene
from simulators.defects.defect import (
    ChangesSums,
    Defect,
    DistortsLength,
    DistortsPosition,
    DistortsSpots,
    MovesBase,
    MovesDevice,
    MovesFixture,
    MovesLink,
    MovesStations,
    MovesTool,
    ReadsAngle,
    TurnsJoint,
)

Floats = NDArray[np.float64]
READING_STEPS = 12  # an error of slope 1e-2 shrinks to 1e-24
BALANCE_STEPS = 6  # deflections of 1e-2 at most: what is left is below 1e-12
SETTLED = 1e-10  # m, rad: what the last step of the balance may still change


@dataclass(frozen=True, eq=False)
class Stance:
    """How the arm truly stands, row by row."""

    joint_rad: Floats  # (row, n)
    frames: Frames
    load: Load | None  # None when nothing is there that could give way
    T_base_tool: Floats  # (row, 4, 4) the flange with the tool's own motion
    settled: bool  # the balance was found


def stand(rig: TrueRig, scene: Scene, defects: Sequence[Defect], reading_rad: Floats) -> Stance:
    """The arm whose encoders read `reading_rad` (row, n)."""
    shaft_rad = true_shaft_rad(defects, scene, reading_rad)
    return balanced(rig.arm, scene, defects, shaft_rad)


def true_shaft_rad(defects: Sequence[Defect], scene: Scene, reading_rad: Floats) -> Floats:
    """Shaft angles at which the encoders read `reading_rad`: reading = shaft + error(shaft), solved for the shaft."""
    readers = [defect for defect in defects if isinstance(defect, ReadsAngle)]
    shaft_rad = reading_rad
    for _ in range(READING_STEPS if readers else 0):
        shaft_rad = reading_rad - sum(reader.reading_error_rad(shaft_rad, scene) for reader in readers)
    return shaft_rad


def said_rad(defects: Sequence[Defect], scene: Scene, shaft_rad: Floats) -> Floats:
    """What the encoders read of shafts at `shaft_rad`."""
    readers = [defect for defect in defects if isinstance(defect, ReadsAngle)]
    return shaft_rad + sum((reader.reading_error_rad(shaft_rad, scene) for reader in readers), np.zeros_like(shaft_rad))


def balanced(arm: Arm, scene: Scene, defects: Sequence[Defect], shaft_rad: Floats) -> Stance:
    """The pose in which the deflections belong to the load that they cause."""
    turners = [defect for defect in defects if isinstance(defect, TurnsJoint)]
    movers = [defect for defect in defects if isinstance(defect, (MovesLink, MovesBase))]
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    joint_rad = shaft_rad + arm.zero_rad
    frames = forward(arm, joint_rad)
    if not defects:
        return Stance(joint_rad, frames, None, frames.flange, True)
    load = weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m)
    left = 0.0
    for _ in range(BALANCE_STEPS if turners or movers else 0):
        extra_rad = sum((turner.extra_turn_rad(shaft_rad, scene, load) for turner in turners), np.zeros_like(shaft_rad))
        joint_rad = shaft_rad + arm.zero_rad + extra_rad
        foot = _foot(defects, scene, load)
        moved = forward(arm, joint_rad, foot=foot, links=_links(arm, defects, joint_rad, scene, load))
        left = float(np.abs(moved.flange - frames.flange).max())
        frames = moved
        load = weigh(arm, frames, foot, scene.payload_kg, scene.payload_com_m)
    return Stance(joint_rad, frames, load, _tool(frames.flange, defects, scene, load), left < SETTLED)


def _foot(defects: Sequence[Defect], scene: Scene, load: Load) -> Floats:
    foot = np.broadcast_to(np.eye(4), (len(scene), 4, 4))
    for defect in defects:
        if isinstance(defect, MovesBase):
            foot = defect.base_motion(scene, load) @ foot
    return foot


def _links(arm: Arm, defects: Sequence[Defect], joint_rad: Floats, scene: Scene, load: Load) -> dict[int, Floats]:
    motions: dict[int, Floats] = {}
    for defect in defects:
        if isinstance(defect, MovesLink):
            for link in defect.links:
                motion = defect.link_motion(link, arm.fixed[link, :3, 3], joint_rad, scene, load)
                motions[link] = motion @ motions[link] if link in motions else motion
    return motions


def _tool(flange: Floats, defects: Sequence[Defect], scene: Scene, load: Load) -> Floats:
    for defect in defects:
        if isinstance(defect, MovesTool):
            flange = flange @ defect.tool_motion(scene, load)
    return flange


Whole = NDArray[np.int64]
FULL_SUM_V = 5.0  # sum signal of the whole laser: amplifiers are set so that they do not saturate
REFLECTIVITY = 0.3  # bare silicon at 635 nm under its passivation


def shine(
    T_base_tool: Floats, direction: Floats, psd1: Floats, psd2_in_psd1: Floats, first: Whole, power: Floats
) -> Light:
    """Light on both sensors. Poses (row, 4, 4) in the base: of the laser, beam along `direction` (3,), and of PSD 1."""
    psd2 = psd1 @ psd2_in_psd1
    second_struck = (first == 2)[:, np.newaxis, np.newaxis]
    near, far = np.where(second_struck, psd2, psd1), np.where(second_struck, psd1, psd2)
    to_near = inverse(near)
    origin = _point(to_near, T_base_tool[:, :3, 3])
    onward = _along(to_near, T_base_tool[:, :3, :3] @ direction)
    near_m = _meet(origin, onward)
    to_far = inverse(far) @ near
    mirrored = onward * np.array([1.0, 1.0, -1.0])
    arriving = _along(to_far, mirrored)
    far_m = _meet(_point(to_far, near_m), arriving)
    spot_m = np.stack((near_m[:, :2], far_m[:, :2]), axis=1)
    directions = np.stack((onward, arriving), axis=1)
    shares = np.array([1.0 - REFLECTIVITY, REFLECTIVITY * (1.0 - REFLECTIVITY)])
    sum_v = FULL_SUM_V * power[:, np.newaxis] * shares
    swap = first == 2
    for values in (spot_m, directions, sum_v):
        values[swap] = values[swap][:, ::-1]
    return Light(spot_m, directions, sum_v)


def _point(motion: Floats, point: Floats) -> Floats:
    return np.einsum("rij,rj->ri", motion[:, :3, :3], point) + motion[:, :3, 3]


def _along(motion: Floats, direction: Floats) -> Floats:
    return np.einsum("rij,rj->ri", motion[:, :3, :3], direction)


def _meet(origin: Floats, direction: Floats) -> Floats:
    return origin - direction * (origin[:, 2] / direction[:, 2])[:, np.newaxis]


@dataclass(frozen=True, eq=False)
class SpotReadings:
    """What both sensors read."""

    seen_m: Floats  # (row, 4)
    sum_v: Floats  # (row, 2)
    light: Light  # as it truly fell


def spots(rig: TrueRig, fixture: DualPsd, scene: Scene, defects: Sequence[Defect], stance: Stance) -> SpotReadings:
    """The dual-PSD fixture."""
    laser = stance.T_base_tool @ shifted(fixture.laser_origin_m)
    psd1 = fixture.places[scene.placement - 1]
    for defect in defects:
        if isinstance(defect, MovesFixture):
            psd1 = psd1 @ defect.fixture_motion(scene)
        if isinstance(defect, MovesStations):
            psd1 = defect.stations_motion(scene) @ psd1
    light = shine(laser, fixture.laser_direction, psd1, fixture.psd2_in_psd1, scene.first_psd, scene.laser_power)
    if scene.laser_sum_v is not None:
        light = replace(light, sum_v=scene.laser_sum_v)
    seen_m, sum_v = light.spot_m, light.sum_v
    for defect in defects:
        if isinstance(defect, DistortsSpots):
            seen_m = defect.seen_spots_m(seen_m, light, scene)
        if isinstance(defect, ChangesSums):
            sum_v = defect.seen_sum_v(sum_v, scene)
    return SpotReadings(seen_m.reshape(-1, 4), sum_v, light)


def tip_m(rig: TrueRig, stance: Stance) -> Floats:
    """The target or probe in the base frame, (row, 3)."""
    return carried_m(rig, stance.T_base_tool)


def carried_m(rig: TrueRig, T_base_flange: Floats) -> Floats:
    """(row, 3) the same point for a flange at (row, 4, 4)."""
    return (T_base_flange[:, :3, :3] @ rig.tool_point_m[..., np.newaxis])[..., 0] + T_base_flange[:, :3, 3]


def position_m(rig: TrueRig, device: Device, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Floats:
    """The tracker: (row, 3) in its frame."""
    seen_m = _in_device(rig, device, scene, defects, stance)
    for defect in defects:
        if isinstance(defect, DistortsPosition):
            seen_m = defect.seen_position_m(seen_m, scene)
    return seen_m


def length_m(rig: TrueRig, device: Device, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Floats:
    """The wire: (row, 1)."""
    seen_m = np.linalg.norm(_in_device(rig, device, scene, defects, stance), axis=1)
    for defect in defects:
        if isinstance(defect, DistortsLength):
            seen_m = defect.seen_length_m(seen_m, scene)
    return seen_m[:, np.newaxis]


def flange_turn(device: Device, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Floats:
    """(row, 3, 3) the flange, with the tool's own motion, as the device has it in its axes."""
    return np.asarray(_to_device(device, scene, defects)[:, :3, :3] @ stance.T_base_tool[:, :3, :3])


def _to_device(device: Device, scene: Scene, defects: Sequence[Defect]) -> Floats:
    pose = np.broadcast_to(device.pose, (len(scene), 4, 4))
    for defect in defects:
        if isinstance(defect, MovesDevice):
            pose = pose @ defect.device_motion(scene)
    return inverse(pose)


def _in_device(rig: TrueRig, device: Device, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Floats:
    back = _to_device(device, scene, defects)
    return np.einsum("rij,rj->ri", back[:, :3, :3], tip_m(rig, stance)) + back[:, :3, 3]
