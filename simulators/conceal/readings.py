"""What the instrument of a rig would say, without noise: (row, channel) in m.

dual-psd: psd1 x, y, psd2 x, y. position: x, y, z in the device's frame. wire: length. seat: where the joint readings
place the probe against its cone, x, y, z in the base frame (the readings themselves are the joint angles).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import inverse, shifted
from simulators.conceal.chain import Stance
from simulators.conceal.optics import shine
from simulators.conceal.rig import Device, DualPsd, TrueRig
from simulators.defects.defect import (
    ChangesSums,
    Defect,
    DistortsLength,
    DistortsPosition,
    DistortsSpots,
    MovesDevice,
    MovesFixture,
)
from simulators.defects.scene import Light, Scene

Floats = NDArray[np.float64]


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
