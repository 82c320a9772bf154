"""The camera measured against the beam: where the laser's line runs before the camera.

Hand-eye calibration tells the mount in the flange as the arm's readings have it, whose last zero may be wrong by
degrees; the laser is drawn in the flange as built. What an aim wants is neither, but the laser's line before the
camera. A pose with light on both faces tells it: the spots fix the beam in the fixture (FixtureOptics.line), the
picture the fixture before the camera. The arm takes no part in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.aiming.pose import laser_in_flange
from acquisition.believed import BelievedArm
from acquisition.camera.model import CameraModel

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Line:
    """The laser's beam before the camera: a point (3,) m where it strikes the first face, and its direction (3,)."""

    point_m: Floats
    direction: Floats


def line_before(T_camera_fixture: Floats, hit_m: Floats, direction: Floats) -> Line:
    """The beam that strikes at `hit_m` (3,), both in the fixture's frame."""
    R = T_camera_fixture[:3, :3]
    return Line(R @ hit_m + T_camera_fixture[:3, 3], R @ direction)


def onto_beam(model: CameraModel, lines: Sequence[Line], arm: BelievedArm) -> tuple[CameraModel, float, float]:
    """The mount turned and shifted as little as brings the mean of `lines` onto the believed laser; and their scatter:

    rms angle (rad) of the directions, rms distance (m) of the points struck from the mean line.
    """
    direction = np.mean([line.direction for line in lines], axis=0)
    direction /= np.linalg.norm(direction)
    point_m = np.mean([line.point_m for line in lines], axis=0)
    bend = [np.linalg.norm(np.cross(line.direction, direction)) for line in lines]
    off_m = [np.linalg.norm(np.cross(line.point_m - point_m, direction)) for line in lines]
    laser_m, along = laser_in_flange(arm)
    T = model.T_flange_camera.copy()
    turn = Rotation.align_vectors(along[None], (T[:3, :3] @ direction)[None])[0].as_matrix()
    T[:3, :3] = turn @ T[:3, :3]
    away_m = laser_m - (T[:3, :3] @ point_m + T[:3, 3])
    T[:3, 3] += away_m - along * float(along @ away_m)
    return replace(model, T_flange_camera=T), _rms(bend), _rms(off_m)


def _rms(values: Sequence[np.floating]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
