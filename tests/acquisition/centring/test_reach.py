"""Reaching a beam: the believed beam lands where it was asked to, from where it was asked to, rolled as asked."""

import numpy as np
import pytest

from acquisition.centring.aim import BeamTarget, between, flange_for, reach, spots_at
from acquisition.errors import UnreachableError
from calibeam.learner import FittedLearner


@pytest.mark.parametrize("first", [1, 2])
@pytest.mark.parametrize("roll_rad", [-2.0, 0.0, 1.0])
def test_the_assumed_spots_are_the_asked_for_ones(rig, first: int, roll_rad: float) -> None:
    learner, rng = FittedLearner(rig), np.random.default_rng(3)
    T = learner.T_base_fixture(1)
    target = BeamTarget(first, (0.004, -0.003, 0.002, 0.006), 0.2, roll_rad)
    q_rad = reach(learner.arm, flange_for(learner.arm, learner.optics, T, target), np.array(rig.motion.home_rad), rng)
    spots_m = spots_at(learner.arm, learner.optics, T, q_rad, first)
    assert spots_m == pytest.approx(target.spots_m, abs=1e-7)
    assert np.all(q_rad >= learner.arm.lower_rad)
    assert np.all(q_rad <= learner.arm.upper_rad)


def test_a_beam_out_of_reach_is_refused_by_name(rig) -> None:
    learner = FittedLearner(rig)
    T = learner.T_base_fixture(1).copy()
    T[0, 3] += 3.0
    target = BeamTarget(1, (0.0, 0.0, 0.0, 0.0), 0.2, 0.0)
    with pytest.raises(UnreachableError, match="no joint position within limits"):
        reach(
            learner.arm,
            flange_for(learner.arm, learner.optics, T, target),
            np.array(rig.motion.home_rad),
            np.random.default_rng(1),
            starts=3,
        )


def test_half_way_between_two_beams() -> None:
    near = BeamTarget(1, (0.0, 0.0, 0.0, 0.0), 0.1, -1.0)
    far = BeamTarget(1, (0.002, 0.004, 0.006, 0.008), 0.3, 1.0)
    middle = between(near, far, 0.5)
    assert middle.spots_m == pytest.approx((0.001, 0.002, 0.003, 0.004))
    assert (middle.stand_off_m, middle.roll_rad) == pytest.approx((0.2, 0.0))


@pytest.mark.parametrize("placement", [1, 2, 3])
def test_neither_elbow_nor_wrist_goes_below_the_table(rig, placement: int) -> None:
    learner, rng = FittedLearner(rig), np.random.default_rng(5)
    T = learner.T_base_fixture(placement)
    for roll_rad in np.linspace(-2.6, 2.6, 5):
        target = BeamTarget(1, (0.0, 0.0, 0.0, 0.0), 0.2, float(roll_rad))
        flange = flange_for(learner.arm, learner.optics, T, target)
        q_rad = reach(learner.arm, flange, np.array(rig.motion.home_rad), rng)
        heights_m = learner.arm.frames(q_rad[None])[0, 2:, 2, 3]
        assert heights_m.min() > 0.0
