"""A drive that winds up under its measured torque: how far, and when nothing can be said."""

import numpy as np
import pytest

from calibrate.diagnose.streams.deflection import deflections
from calibrate.diagnose.streams.track import Outcome, Track

PERIOD_S = 0.004
SOFT = 1e-7  # rad/Nm
OWN_RAD = 5e-6


def motion(seed, seconds=30.0):
    """Time, angles and speeds of three joints that swing, and their torques of inertia and gravity."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, PERIOD_S)
    waves = rng.uniform(0.1, 0.9, (3, 3))[:, :, None], rng.uniform(0.0, 6.0, (3, 3))[:, :, None]
    sizes = rng.uniform(0.1, 0.4, (3, 3))[:, :, None]
    phase = 2.0 * np.pi * waves[0] * t + waves[1]
    q = np.sum(sizes * np.sin(phase), axis=1).T
    speed = np.sum(sizes * 2.0 * np.pi * waves[0] * np.cos(phase), axis=1).T
    acceleration = -np.sum(sizes * (2.0 * np.pi * waves[0]) ** 2 * np.sin(phase), axis=1).T
    torque = 300.0 * acceleration + 1500.0 * np.cos(q + 0.3)
    return rng, t, q, speed, torque


def tracks(rng, t, q, second, torque, joints=()):
    own = rng.normal(0.0, OWN_RAD, second.shape)
    first = Track("joints", "rad", t, q + rng.normal(0.0, OWN_RAD, q.shape))
    return Track("encoders", "rad", t, second + own, joints), first, Track("torque", "Nm", t, torque)


def test_the_compliance_of_each_joint_is_found_within_its_sigma():
    rng, t, q, _, torque = motion(3)
    soft = SOFT * np.array([1.0, 2.0, 0.7])
    found = deflections(*tracks(rng, t, q, q - soft * torque, torque))
    assert [one.outcome for one in found] == [Outcome.FOUND] * 3
    for one, true in zip(found, soft, strict=True):
        assert one.compliance == pytest.approx(true, abs=4.0 * one.sigma)
        assert one.sigma < 0.2 * true
        assert one.unseen_after_rad < 0.5 * one.unseen_before_rad


@pytest.mark.parametrize("seed", range(8))
def test_a_stiff_drive_and_a_disc_off_its_centre_give_no_compliance(seed):
    rng, t, q, _, torque = motion(seed)
    found = deflections(*tracks(rng, t, q, q + 2e-4 * np.sin(q + 1.0), torque))
    assert all(one.outcome is Outcome.ABSENT for one in found)
    assert all(one.compliance < 4.0 * one.sigma for one in found)


def test_a_motor_that_works_against_friction_does_not_lag():
    rng, t, q, speed, torque = motion(5)
    of_motor = torque + 400.0 * speed  # of which friction takes its part in front of the gear
    found = deflections(*tracks(rng, t, q, q - SOFT * torque, of_motor))
    assert all(one.friction_may_lag for one in found)
    assert all(one.compliance == pytest.approx(SOFT, abs=4.0 * one.sigma) for one in found)


def test_second_encoders_of_some_joints_are_judged_as_those_joints():
    rng, t, q, _, torque = motion(7)
    second, first, of_all = tracks(rng, t, q, q - SOFT * np.array([0.0, 0.0, 3.0]) * torque, torque)
    found = deflections(second.of([2]), first.of([2]), of_all)
    assert [(one.joint, one.outcome) for one in found] == [(3, Outcome.FOUND)]
    assert deflections(second.of([2]), first.of([2]), of_all.of([0])) == ()


def test_a_motion_of_a_second_shows_nothing():
    rng, t, q, _, torque = motion(9, seconds=1.0)
    found = deflections(*tracks(rng, t, q, q - SOFT * torque, torque))
    assert {one.outcome for one in found} == {Outcome.NOT_DETERMINABLE}
    assert all(one.compliance is None for one in found)
