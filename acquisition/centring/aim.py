"""Where the flange must be so that the beam lights both faces at given spots, and the joint readings that bring it
there.

Four spot coordinates fix the line; stand-off (along the beam) and roll (about it) are the two freedoms left
(Deng, Ding, Zhang 2019: "slide along the beam, roll about it"). Joint readings are those of an assumed arm, near where
it stands and clear of the table.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.centring.believed import BelievedArm, FixtureOptics
from acquisition.errors import UnreachableError
from acquisition.motion.inverse.solve import AtPose, refine, unwound, within
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
    """T_base_flange (4, 4) that puts the assumed beam on target."""
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
    """Laser origin (3,) m and direction (3,) in the flange frame, read off the assumed arm at its zero."""
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


TABLE_M = 0.02  # neither the elbow nor a joint beyond it may come lower than this above the base plane
ELBOW = 2  # frame behind the second link


def reach(
    arm: BelievedArm, T_base_flange: Floats, near_rad: Floats, rng: np.random.Generator, starts: int = 12
) -> Floats:
    """Joint readings (joint,) that put the flange there, the first found close to `near_rad`. UnreachableError.

    `starts` are tried around `near_rad`, and where none leads there as many anywhere in the joint range.
    """
    goal = AtPose(T_base_flange[None])
    for start in _starts(arm, near_rad, rng, starts):
        q_rad = unwound(refine(arm, goal, start[None]).q_rad[0], near_rad, arm)
        if within(arm, q_rad) and clear_of_table(arm, q_rad):
            return q_rad
    x, y, z = T_base_flange[:3, 3]
    raise UnreachableError(
        f"no joint position within limits puts the flange at ({x:.3f}, {y:.3f}, {z:.3f}) m with the asked-for roll "
        f"({2 * starts} starts tried); choose another stand-off or roll, or move the fixture"
    )


def clear_of_table(arm: BelievedArm, q_rad: Floats) -> bool:
    """Whether elbow, wrist and laser stay above the base plane."""
    origin_m, _ = arm.beam(q_rad)
    return bool(np.min(arm.frames(q_rad[None])[0, ELBOW:, 2, 3]) > TABLE_M and origin_m[2] > TABLE_M)


def _starts(arm: BelievedArm, near_rad: Floats, rng: np.random.Generator, starts: int) -> Iterator[Floats]:
    yield near_rad
    for k in range(starts - 1):
        yield near_rad + rng.normal(0.0, 0.3 + 0.1 * k, near_rad.size)
    for _ in range(starts):
        yield rng.uniform(arm.lower_rad, arm.upper_rad)
