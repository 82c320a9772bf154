"""Places where a fixture could stand: on rings about the base, at some heights, turned towards the arm as it is now."""

import msgspec
import numpy as np

from acquisition.recording.rig import Placement, Pose, Rig
from calibrate.arms.convert import pose_of
from calibrate.rigid import transform

HEIGHTS_M = (-0.05, 0.0, 0.15)  # beside that of the rig's first place
RADII = (0.8, 1.0, 1.25)  # of the distance of the rig's first place from axis 1
BEARINGS_DEG = (-75.0, -35.0, 0.0, 35.0, 75.0)  # about axis 1, from the rig's first place


def with_grid(rig: Rig) -> Rig:
    """The rig with these places beside its own, numbered on; known distances between places are left out."""
    first = rig.placement_list[0].psd1_in_base
    T = transform(first.origin_m, first.rotation_rad)
    number, out = max(rig.placements), list(rig.placement_list)
    for height in HEIGHTS_M:
        for radius in RADII:
            for bearing in BEARINGS_DEG:
                if (height, radius, bearing) == (0.0, 1.0, 0.0):
                    continue
                number += 1
                out.append(Placement(number, _moved(T, height, radius, float(np.radians(bearing)))))
    return msgspec.structs.replace(rig, placement_list=tuple(out), known_distances=())


def _moved(T: np.ndarray, height_m: float, radius: float, bearing_rad: float) -> Pose:
    turn = transform((0.0, 0.0, 0.0), (0.0, 0.0, bearing_rad))
    moved = T.copy()
    moved[:2, 3] *= radius
    moved[2, 3] += height_m
    return pose_of(turn @ moved)
