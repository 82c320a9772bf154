"""What the instrument of a rig would say, without noise: (row, channel) in m.

dual-psd: psd1 x, y, psd2 x, y. position: x, y, z in the device frame. wire: length. seat: where the joint readings
place the probe against its cone, x, y, z in the base frame (the readings themselves are the joint angles).

The beam on both faces: in a sensor frame the face is z = 0, the beam meets it at o - d (o_z / d_z), and a mirror turns
d_z about (law of reflection). The cosines and the power share of each face follow.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import inverse, shifted
from simulators.conceal.chain import Stance
from simulators.conceal.rig import Device, DualPsd, TrueRig
from simulators.defects import Light, Scene
from simulators.defects.defect import (
    ChangesSums,
    Defect,
    DistortsLength,
    DistortsPosition,
    DistortsSpots,
    MovesDevice,
    MovesFixture,
)

Floats = NDArray[np.float64]
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
class Spots:
    """What both sensors say."""

    seen_m: Floats  # (row, 4)
    sum_v: Floats  # (row, 2)
    light: Light  # as it truly fell


def spots(rig: TrueRig, fixture: DualPsd, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Spots:
    """The dual-PSD fixture."""
    laser = stance.T_base_tool @ shifted(fixture.laser_origin_m)
    psd1 = fixture.places[scene.placement - 1]
    for defect in defects:
        if isinstance(defect, MovesFixture):
            psd1 = psd1 @ defect.fixture_motion(scene)
    light = shine(laser, fixture.laser_direction, psd1, fixture.psd2_in_psd1, scene.first_psd, scene.laser_power)
    if scene.laser_sum_v is not None:
        light = replace(light, sum_v=scene.laser_sum_v)
    seen_m, sum_v = light.spot_m, light.sum_v
    for defect in defects:
        if isinstance(defect, DistortsSpots):
            seen_m = defect.seen_spots_m(seen_m, light, scene)
        if isinstance(defect, ChangesSums):
            sum_v = defect.seen_sum_v(sum_v, scene)
    return Spots(seen_m.reshape(-1, 4), sum_v, light)


def tip_m(rig: TrueRig, stance: Stance) -> Floats:
    """The target or probe in the base frame, (row, 3)."""
    return stance.T_base_tool[:, :3, :3] @ rig.tool_point_m + stance.T_base_tool[:, :3, 3]


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


def _in_device(rig: TrueRig, device: Device, scene: Scene, defects: Sequence[Defect], stance: Stance) -> Floats:
    pose = np.broadcast_to(device.pose, (len(scene), 4, 4))
    for defect in defects:
        if isinstance(defect, MovesDevice):
            pose = pose @ defect.device_motion(scene)
    back = inverse(pose)
    return np.einsum("rij,rj->ri", back[:, :3, :3], tip_m(rig, stance)) + back[:, :3, 3]
