"""Tracker positions identified together with the tool point and the tracker's place."""

import numpy as np
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from calibrate.model.placement import Device, Target
from calibrate.model.rigid import transform
from calibrate.model.sensors.position import Position


def test_a_position_is_the_target_seen_from_the_device():
    T_base_device = transform([1.0, -0.5, 0.3], [0.2, -0.4, 1.1])
    T_base_flange = transform([0.4, 0.1, 0.6], [0.5, 0.3, -0.7])
    sensor = Position(Target(np.array([0.02, 0.0, 0.08])), Device(T_base_device))
    tip = Rotation.from_rotvec([0.5, 0.3, -0.7]).apply([0.02, 0.0, 0.08]) + np.array([0.4, 0.1, 0.6])
    expected = Rotation.from_rotvec([0.2, -0.4, 1.1]).inv().apply(tip - [1.0, -0.5, 0.3])
    assert_allclose(sensor.expect(np.zeros(9), T_base_flange[None])[0], expected, atol=1e-14)


def test_a_tolerance_of_the_device_becomes_a_prior_and_none_stays_none():
    assert {p.prior for p in Device(np.eye(4)).parameters} == {np.inf}
    assert [p.prior for p in Device(np.eye(4), (1e-3, 2e-3)).parameters] == [1e-3] * 3 + [2e-3] * 3
