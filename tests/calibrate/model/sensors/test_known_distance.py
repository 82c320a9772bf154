"""Known distances between placements: rows on placement parameters alone."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from calibrate.errors import DataError
from calibrate.model.optics.dual_psd import DualPsd, Fixture
from calibrate.model.optics.laser import LaserMount
from calibrate.model.rigid import transform
from calibrate.model.sensors.known_distance import KnownDistances


@pytest.fixture
def known():
    places = {2: transform([0.4, 0.1, 0.2], [0.3, 0.1, 2.0]), 5: transform([0.1, -0.5, 0.3], [1.0, 0, 0.5])}
    mount = LaserMount.from_drawing(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    sensor = DualPsd(
        mount, Fixture(0.01, transform([0, 0.1, 0.1], [2.3, 0, 0]), places), np.array([2, 5]), np.array([1, 2])
    )
    parameters = tuple(p for p in sensor.parameters if p.name.startswith("placement"))
    centres, axes = {k: T[:3, 3] for k, T in places.items()}, {k: T[:3, :3] for k, T in places.items()}
    between, lengths_m, sigmas_m = np.array([[2, 5], [5, 2]]), np.array([0.68, 0.67]), np.array([1e-5, 2e-5])
    return KnownDistances("placement", parameters, centres, axes, between, lengths_m, sigmas_m)


def test_the_residual_is_in_sigmas_of_the_stated_length(known):
    length = np.linalg.norm([0.3, 0.6, -0.1])
    assert_allclose(known.residual(np.zeros(12)), [(length - 0.68) / 1e-5, (length - 0.67) / 2e-5])


def test_derivative_by_every_placement_parameter(known):
    theta = np.random.default_rng(3).normal(0, 0.01, 12)
    steps = np.eye(12) * 1e-6
    numeric = [(known.residual(theta + s) - known.residual(theta - s)) / 2e-6 for s in steps]
    assert_allclose(known.jacobian(theta), np.transpose(numeric), atol=1e-3)  # of 1e5


def test_a_selection_keeps_the_unknowns(known):
    cut = known.select(np.array([1]))
    assert (cut.rows, len(cut.parameters)) == (1, 12)
    assert_allclose(cut.residual(np.zeros(12)), known.residual(np.zeros(12))[1:])


def test_an_unknown_placement_is_refused(known):
    with pytest.raises(DataError, match="placement 9 is not in the rig"):
        replace(known, between=np.array([[2, 9], [5, 2]]))
