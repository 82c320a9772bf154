"""From where the board is looked at to measure the camera: all round, near and far, turned, and not only in the middle.

Rotations about two axes across each other fix the mount; tilts of the board against the picture fix the focal length.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from acquisition.aiming.reach import reach
from acquisition.believed import BelievedArm
from acquisition.camera.model import CameraModel
from acquisition.errors import UnreachableError
from acquisition.motion.kinematics import inverse, transform

Floats = NDArray[np.float64]

TILTS_RAD = (0.0, 0.35, 0.6)  # of the view against the board's normal
AZIMUTHS = 5  # on every tilt but the first
ROLLS_RAD = (-0.5, 0.0, 0.5)  # about the view
SHARES = (0.14, 0.20, 0.28)  # of the picture's width that the board takes: far to near
OFF_CENTRE = 0.25  # of half the picture, by which the view passes the board


def viewpoints(model: CameraModel, radius_m: float) -> Iterator[Floats]:
    """T_board_camera (4, 4); `radius_m` of the board."""
    half_view = 0.5 * model.size_px[0] / model.matrix_px[0, 0]
    stops = [(tilt, k) for tilt in TILTS_RAD for k in range(1 if tilt == 0.0 else AZIMUTHS)]
    for number, (tilt, k) in enumerate(stops):
        azimuth = 2.0 * np.pi * (k + 0.5 * (number % 2)) / AZIMUTHS
        distance_m = radius_m / (SHARES[number % len(SHARES)] * half_view)
        towards = transform(rotation_rad=tilt * np.array([np.cos(azimuth), np.sin(azimuth), 0.0]))
        upright = transform((0.0, 0.0, distance_m), (np.pi, 0.0, 0.0))  # x right, y down, z onto the board
        passed = OFF_CENTRE * half_view * np.array([np.cos(3.0 * azimuth), np.sin(3.0 * azimuth)])
        aside = transform(rotation_rad=(passed[1], -passed[0], 0.0))
        roll = transform(rotation_rad=(0.0, 0.0, ROLLS_RAD[number % len(ROLLS_RAD)]))
        yield towards @ upright @ aside @ roll


def stops(
    arm: BelievedArm, model: CameraModel, T_base_board: Floats, radius_m: float, q_rad: Floats, rng: np.random.Generator
) -> Iterator[Floats]:
    """Joint readings (joint,) of the tour from `q_rad`, as drawn; what the arm cannot reach is left out."""
    for T_board_camera in viewpoints(model, radius_m):
        try:
            q_rad = reach(arm, T_base_board @ T_board_camera @ inverse(model.T_flange_camera), q_rad, rng)
        except UnreachableError:
            continue
        yield q_rad
