"""What acquisition needs to know of the arm and the fixture: passed in, never imported.

`calibeam` builds these from the kinematic models of `calibrate`; a test passes its own.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.kinematics import Kinematics

Floats = NDArray[np.float64]


class BelievedArm(Kinematics, Protocol):
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


def spots_at(arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, first: int) -> Floats:
    """Spots (4,) m expected at joint readings `q_rad`."""
    return optics.spots(*in_fixture(T_base_fixture, *arm.beam(q_rad)), first)


def spots_by_joints(
    arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, first: int
) -> Floats:
    """d(spots)/dq, (4, joint): Jp Ad(T) Jr of Deng, Ding, Zhang 2019, equation (6)."""
    sensor = optics.spots_by_beam(*in_fixture(T_base_fixture, *arm.beam(q_rad)), first)
    return sensor @ beam_by_joints(arm, T_base_fixture, q_rad)


def beam_by_joints(arm: BelievedArm, T_base_fixture: Floats, q_rad: Floats) -> Floats:
    """d(origin, direction)/dq, (6, joint), of the beam as seen from the fixture."""
    return (T_base_fixture[:3, :3].T @ arm.beam_jacobian(q_rad).reshape(2, 3, -1)).reshape(6, -1)
