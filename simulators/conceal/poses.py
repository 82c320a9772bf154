"""Poses of a session: from which the beam strikes both faces where it is wanted, or anywhere over the workspace.

A line through point 1 on the first face and through the mirror image of point 2 strikes both (law of reflection). The
laser stands on that line, turned about it at random; the arm is solved for on the true rig.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simulators.arm.kinematics import Arm, forward, inverse, moved, reach_pose, turned, within_limits
from simulators.conceal.rig import DualPsd, TrueRig

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
FREE_CLEAR_M = 0.05  # every joint beyond the second, and the flange, stays this far above the floor
MARGIN = 0.92  # of the limits: nobody drives into the end stop


def free_poses(arm: Arm, number: int, rng: np.random.Generator) -> Floats:
    """Readings (row, n)."""
    middle, half = 0.5 * (arm.lower_rad + arm.upper_rad), 0.5 * MARGIN * (arm.upper_rad - arm.lower_rad)
    found = np.empty((0, arm.n_joints))
    while len(found) < number:
        reading_rad = middle + half * rng.uniform(-1.0, 1.0, (2 * number, arm.n_joints))
        frames = forward(arm, reading_rad + arm.zero_rad)
        height_m = np.minimum(frames.turning[:, 2:, 2, 3].min(axis=1), frames.flange[:, 2, 3])
        found = np.concatenate((found, reading_rad[height_m > FREE_CLEAR_M]))
    return found[:number]


EDGE = 0.85  # of half the face: further out a spot of 1 mm is cut
CENTRED_M = 20e-6  # where a servo stops
STAND_OFF_M = (0.08, 0.45)
BEAM_CLEAR_M = 0.03  # every joint stays this far above the floor
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Shots:
    """Poses that reach: readings (row, n) and the sensor struck first."""

    reading_rad: Floats
    first_psd: Whole


def shots(rig: TrueRig, fixture: DualPsd, place: int, wanted: int, centred: float, rng: np.random.Generator) -> Shots:
    """Up to `wanted` poses at place `place` (from 1); a share `centred` of them aims at both centres."""
    found: list[Floats] = []
    firsts: list[Whole] = []
    have, tried, share = 0, 0, 0.1
    for _ in range(ROUNDS):
        if have >= wanted:
            break
        number = int(np.clip(1.3 * (wanted - have) / share, 60, 1200))
        first = rng.integers(1, 3, number)
        target = _laser_poses(fixture, place, first, centred, rng)
        flange = target @ inverse(_laser_in_flange(fixture))
        start = rng.uniform(rig.arm.lower_rad, rig.arm.upper_rad, (number, rig.arm.n_joints)) + rig.arm.zero_rad
        joint_rad, arrived = reach_pose(rig.arm, flange, start)
        reading_rad, inside = within_limits(rig.arm, joint_rad)
        good = arrived & inside
        good[good] &= forward(rig.arm, joint_rad[good]).turning[:, 2:, 2, 3].min(axis=1) > BEAM_CLEAR_M
        found.append(reading_rad[good])
        firsts.append(first[good])
        have, tried = have + int(good.sum()), tried + number
        share = max(have / tried, 0.01)
        if tried >= 1000 and share < 0.02:
            break
    return Shots(np.concatenate(found)[:wanted], np.concatenate(firsts)[:wanted])


def reachable_share(rig: TrueRig, fixture: DualPsd, place: int, rng: np.random.Generator) -> float:
    """Share of random lines to a place that one solution attempt reaches."""
    first = rng.integers(1, 3, 120)
    flange = _laser_poses(fixture, place, first, 0.0, rng) @ inverse(_laser_in_flange(fixture))
    start = rng.uniform(rig.arm.lower_rad, rig.arm.upper_rad, (120, rig.arm.n_joints)) + rig.arm.zero_rad
    joint_rad, arrived = reach_pose(rig.arm, flange, start)
    return float(np.mean(arrived & within_limits(rig.arm, joint_rad)[1]))


def _laser_in_flange(fixture: DualPsd) -> Floats:
    """(4, 4): origin at the laser, z along the beam."""
    return moved(fixture.laser_origin_m, _towards(fixture.laser_direction[np.newaxis]).as_rotvec()[0])


def _towards(direction: Floats) -> Rotation:
    """Rotations that turn z into each unit direction (row, 3)."""
    axis = np.cross((0.0, 0.0, 1.0), direction)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle_rad = np.arctan2(sine, direction[:, 2:])
    unit = np.where(sine > 1e-9, axis / np.maximum(sine, 1e-9), np.array([1.0, 0.0, 0.0]))
    return Rotation.from_rotvec(angle_rad * unit)


def _laser_poses(fixture: DualPsd, place: int, first: Whole, centred: float, rng: np.random.Generator) -> Floats:
    """(row, 4, 4) laser frames in the base, z along a beam that strikes both faces."""
    rows = first.size
    reach_m = EDGE * fixture.half_size_m
    spot_m = rng.uniform(-reach_m, reach_m, (rows, 2, 2))
    centre = rng.random(rows) < centred
    spot_m[centre] = rng.normal(0.0, CENTRED_M, (int(centre.sum()), 2, 2))
    psd1 = fixture.places[place - 1]
    swap = (first == 2)[:, np.newaxis, np.newaxis]
    near = np.where(swap, psd1 @ fixture.psd2_in_psd1, psd1)
    near_to_far = np.where(swap, inverse(fixture.psd2_in_psd1), fixture.psd2_in_psd1)
    near_m = np.concatenate((spot_m[:, 0], np.zeros((rows, 1))), axis=1)
    far_m = np.concatenate((spot_m[:, 1], np.zeros((rows, 1))), axis=1)
    image_m = np.einsum("rij,rj->ri", near_to_far[:, :3, :3], far_m) + near_to_far[:, :3, 3]
    image_m[:, 2] *= -1.0
    along = image_m - near_m
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    origin_m = near_m - along * rng.uniform(*STAND_OFF_M, (rows, 1))
    roll = turned(np.array([0.0, 0.0, 1.0]) * rng.uniform(-np.pi, np.pi, (rows, 1)))
    return near @ moved(origin_m, _towards(along).as_rotvec()) @ roll
