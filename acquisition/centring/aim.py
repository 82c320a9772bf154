"""Where the flange must be so that the beam lights both faces at given spots, and the joint readings that bring it
there.

What acquisition needs to know of the arm and the fixture is passed in, never imported: `calibeam` builds it from the
kinematic models of `calibrate`; a test passes its own. Four spot coordinates fix the line; stand-off (along the beam)
and roll (about it) are the two freedoms left (Deng, Ding, Zhang 2019: "slide along the beam, roll about it"). Joint
readings are those of an assumed arm, near where it stands and clear of the table.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import UnreachableError
from acquisition.motion.inverse.solve import AtPose, refine, unwound, within
from acquisition.motion.kinematics import Kinematics, flange

Floats = NDArray[np.float64]


class AssumedArm(Kinematics, Protocol):
    """The arm with its laser as known now. `q_rad` (joint,) are the controller's readings."""

    def beam(self, q_rad: Floats) -> tuple[Floats, Floats]:
        """Origin (3,) m and unit direction (3,) of the laser beam in the base frame."""
        ...

    def beam_jacobian(self, q_rad: Floats) -> Floats:
        """d(origin, direction)/dq, (6, joint)."""
        ...


class FixtureOptics(Protocol):
    """The dual-PSD fixture in its own frame, that of PSD 1. `first` is the face that the beam strikes first, 1 or 2."""

    half_size_m: float

    def spots(self, origin_m: Floats, direction: Floats, first: int) -> Floats:
        """psd1 x, y, psd2 x, y (4,) m of a beam, on the faces continued as planes."""
        ...

    def spots_by_beam(self, origin_m: Floats, direction: Floats, first: int) -> Floats:
        """d(spots)/d(origin, direction), (4, 6)."""
        ...

    def line(self, spots_m: Floats, first: int) -> tuple[Floats, Floats]:
        """The incoming beam that lights both faces at these spots: its point on the first face (3,), direction (3,)."""
        ...


def in_fixture(T_base_fixture: Floats, origin_m: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """A beam of the base frame, seen from the fixture."""
    R = T_base_fixture[:3, :3]
    return R.T @ (origin_m - T_base_fixture[:3, 3]), R.T @ direction


def spots_at(arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, first: int) -> Floats:
    """Spots (4,) m expected at joint readings `q_rad`."""
    return optics.spots(*in_fixture(T_base_fixture, *arm.beam(q_rad)), first)


def spots_by_joints(
    arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, first: int
) -> Floats:
    """d(spots)/dq, (4, joint): Jp Ad(T) Jr of Deng, Ding, Zhang 2019, equation (6)."""
    sensor = optics.spots_by_beam(*in_fixture(T_base_fixture, *arm.beam(q_rad)), first)
    return sensor @ beam_by_joints(arm, T_base_fixture, q_rad)


def beam_by_joints(arm: AssumedArm, T_base_fixture: Floats, q_rad: Floats) -> Floats:
    """d(origin, direction)/dq, (6, joint), of the beam as seen from the fixture."""
    return (T_base_fixture[:3, :3].T @ arm.beam_jacobian(q_rad).reshape(2, 3, -1)).reshape(6, -1)


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


def flange_for(arm: AssumedArm, optics: FixtureOptics, T_base_fixture: Floats, target: BeamTarget) -> Floats:
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


def laser_in_flange(arm: AssumedArm) -> tuple[Floats, Floats]:
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
    arm: AssumedArm, T_base_flange: Floats, near_rad: Floats, rng: np.random.Generator, starts: int = 12
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


def clear_of_table(arm: AssumedArm, q_rad: Floats) -> bool:
    """Whether elbow, wrist and laser stay above the base plane."""
    origin_m, _ = arm.beam(q_rad)
    return bool(np.min(arm.frames(q_rad[None])[0, ELBOW:, 2, 3]) > TABLE_M and origin_m[2] > TABLE_M)


def _starts(arm: AssumedArm, near_rad: Floats, rng: np.random.Generator, starts: int) -> Iterator[Floats]:
    yield near_rad
    for k in range(starts - 1):
        yield near_rad + rng.normal(0.0, 0.3 + 0.1 * k, near_rad.size)
    for _ in range(starts):
        yield rng.uniform(arm.lower_rad, arm.upper_rad)
