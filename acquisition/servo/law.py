"""The servo law of the source with a fixed guess of the fixture pose.

    q' = k [Jp Ad(T) Jr]^+ (yd - yp)        Deng, Ding, Zhang, Food & Machinery 2019(3), equation (8)

The sensor Jacobian Jp is taken at the beam that the measured spots imply, so that only the robot's motion is turned
by the guess T, not the place where the sensor is linearised.
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm, FixtureOptics, beam_by_joints, in_fixture
from acquisition.servo.strategy import Proposal

Floats = NDArray[np.float64]

# The laser can stand neither inside the fixture nor further away than a small arm reaches.
STAND_OFF_RANGE_M = (0.02, 1.0)


def correction(
    arm: BelievedArm,
    optics: FixtureOptics,
    T_base_fixture: Floats,
    q_rad: Floats,
    error_m: Floats,
    spots_m: Floats,
    first: int,
    rank: int = 4,
) -> Floats:
    """The joint step (joint,) that removes the spot error (4,) m by law (8) with gain 1.

    Of a lower `rank` it leaves out what the arm can do least.
    """
    hit_m, direction = optics.line(spots_m, first)
    stand_off_m = stand_off(arm, optics, T_base_fixture, q_rad, spots_m, first)
    sensor = optics.spots_by_beam(hit_m - stand_off_m * direction, direction, first)
    left, sizes, right = np.linalg.svd(sensor @ beam_by_joints(arm, T_base_fixture, q_rad), full_matrices=False)
    return right[:rank].T @ ((left[:, :rank].T @ error_m) / sizes[:rank])


def stand_off(
    arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, q_rad: Floats, spots_m: Floats, first: int
) -> float:
    """From the laser to the first face along the beam (m), as believed, within what can be."""
    hit_m, direction = optics.line(spots_m, first)
    origin_m, _ = in_fixture(T_base_fixture, *arm.beam(q_rad))
    return float(np.clip((hit_m - origin_m) @ direction, *STAND_OFF_RANGE_M))


class FixedGuess:
    """Law (8): the guess of the fixture pose stays as it was given."""

    name = "law8"

    def __init__(
        self, arm: BelievedArm, optics: FixtureOptics, T_base_fixture: Floats, first: int, gain: float = 0.5
    ) -> None:
        self._arm, self._optics, self._T, self._first, self._gain = arm, optics, T_base_fixture, first, gain
        self._q_rad = np.empty(0)
        self._spots_m = np.empty(0)

    def learn(self, q_rad: Floats, spots_m: Floats) -> None:
        self._q_rad, self._spots_m = q_rad, spots_m

    def propose(self, target_m: Floats) -> Proposal:
        error_m = target_m - self._spots_m
        full = correction(self._arm, self._optics, self._T, self._q_rad, error_m, self._spots_m, self._first)
        return Proposal(self._gain * full, "correct", promise=self._gain)
