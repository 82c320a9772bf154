"""Where the flange must be so that the beam lights both faces at given spots, at a stand-off and a roll about the beam.

Four spot coordinates fix the line; stand-off (along the beam) and roll (about it) are the two freedoms left
(Deng, Ding, Zhang 2019: "slide along the beam, roll about it").
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm, FixtureOptics
from acquisition.motion.kinematics import flange

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BeamTarget:
    """One asked-for beam: the spots it shall light, from how far, and how the flange is rolled about it."""

    first: int  # face struck first, 1 or 2
    spots_m: tuple[float, float, float, float]
    stand_off_m: float  # laser origin to first face, along the beam
    roll_rad: float  # of the flange about the beam; 0 has the flange axis as upright as the beam allows


def between(near: BeamTarget, far: BeamTarget, share: float) -> BeamTarget:
    """The target this share of the way from `near` to `far`; both of the same order."""

    def mixed(a: float, b: float) -> float:
        return a + share * (b - a)

    x1, y1, x2, y2 = (mixed(a, b) for a, b in zip(near.spots_m, far.spots_m, strict=True))
    stand_off_m = mixed(near.stand_off_m, far.stand_off_m)
    return BeamTarget(far.first, (x1, y1, x2, y2), stand_off_m, mixed(near.roll_rad, far.roll_rad))


def flange_for(arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, target: BeamTarget) -> Floats:
    """T_base_flange (4, 4) that puts the believed beam on target."""
    hit_m, direction = optics.line(np.array(target.spots_m), target.first)
    R = T_base_fixture[:3, :3]
    direction_base = R @ direction
    origin_base_m = R @ hit_m + T_base_fixture[:3, 3] - target.stand_off_m * direction_base
    mount_origin_m, mount_direction = laser_in_flange(arm)
    world = _axes(direction_base, np.array([0.0, 0.0, 1.0]), target.roll_rad)
    flange = _axes(mount_direction, np.array([0.0, 0.0, 1.0]), 0.0)
    T = np.eye(4)
    T[:3, :3] = world @ flange.T
    T[:3, 3] = origin_base_m - T[:3, :3] @ mount_origin_m
    return T


def laser_in_flange(arm: BelievedArm) -> tuple[Floats, Floats]:
    """Laser origin (3,) m and direction (3,) in the flange frame, read off the believed arm at its zero."""
    q_rad = np.zeros(arm.lower_rad.size)
    T = flange(arm, q_rad)
    origin_m, direction = arm.beam(q_rad)
    return T[:3, :3].T @ (origin_m - T[:3, 3]), T[:3, :3].T @ direction


def _axes(beam: Floats, reference: Floats, roll_rad: float) -> Floats:
    """Right-handed axes (3, 3): the beam; the reference made square to it and rolled; their product."""
    if abs(float(beam @ reference)) > 0.99:  # nearly along the beam: any other reference serves
        reference = np.array([1.0, 0.0, 0.0])
    square = reference - beam * float(reference @ beam)
    square = square / float(np.linalg.norm(square))
    side = np.cross(beam, square)
    rolled = math.cos(roll_rad) * square + math.sin(roll_rad) * side
    third: Floats = np.cross(beam, rolled)
    return np.stack([beam, rolled, third], axis=1)
