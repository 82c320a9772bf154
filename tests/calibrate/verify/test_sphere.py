"""Spheres through touched points, and round places."""

import numpy as np
import pytest
from scipy.optimize import minimize

from calibrate.errors import DataError
from calibrate.verify.measured_lengths import enclosing_diameter_m, fitted_sphere


def directions(count, seed=1):
    way = np.random.default_rng(seed).standard_normal((count, 3))
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def test_points_on_a_sphere_give_it_back():
    found = fitted_sphere(np.array([0.4, -0.2, 0.6]) + 0.0125 * directions(9))
    np.testing.assert_allclose(found.centre_m, [0.4, -0.2, 0.6], atol=1e-12)
    assert found.radius_m == pytest.approx(0.0125, abs=1e-12)
    assert np.ptp(found.distance_m) < 1e-12


def test_the_fit_has_the_least_sum_of_squared_radial_distances():
    points = 0.0125 * directions(25) + 1e-5 * np.random.default_rng(2).standard_normal((25, 3))
    found = fitted_sphere(points)

    def cost(x):
        return 1e12 * np.sum((np.linalg.norm(points - x[:3], axis=1) - x[3]) ** 2)

    here = np.append(found.centre_m, found.radius_m)
    for step in np.vstack([np.eye(4), -np.eye(4)]) * 1e-7:
        assert cost(here + step) > cost(here)


def test_too_few_points_or_points_of_a_plane_show_no_sphere():
    with pytest.raises(DataError, match="a sphere of 4 points: touch it 5 times"):
        fitted_sphere(directions(4))
    flat = directions(8)
    flat[:, 2] = 0.3
    with pytest.raises(DataError, match="lie in one plane"):
        fitted_sphere(flat)


def test_the_smallest_sphere_round_simple_bodies():
    assert enclosing_diameter_m(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]])) == pytest.approx(2.0)
    corner = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0], [0.2, 0.2, 0.0]])
    assert enclosing_diameter_m(corner) == pytest.approx(np.sqrt(2.0))
    cube = np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])).reshape(3, -1).T
    assert enclosing_diameter_m(cube) == pytest.approx(np.sqrt(3.0))
    assert enclosing_diameter_m(np.array([[0.3, 0.1, 0.2]])) == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_the_smallest_sphere_is_what_minimisation_finds(seed):
    """Least r with every point within r of x: a smooth programme with as many conditions as points."""
    points = np.random.default_rng(seed).standard_normal((10, 3))
    within = {"type": "ineq", "fun": lambda x: x[3] ** 2 - np.sum((points - x[:3]) ** 2, axis=1)}
    best = minimize(lambda x: x[3], [0.0, 0.0, 0.0, 9.0], constraints=[within], method="SLSQP", options={"ftol": 1e-12})
    assert best.success
    found = enclosing_diameter_m(1e-5 * points + [0.5, -0.2, 0.3])
    assert found == pytest.approx(2e-5 * best.fun, rel=1e-6)
