"""Circles in space: found exactly, with an honest doubt, and refused where an arc is too short to tell."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from calibrate.errors import DataError
from calibrate.fit.solvers import Status
from calibrate.model.rigid import cross
from calibrate.tool_axes.circle import fit_circle

CENTRE, AXIS = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -2.0]) / 3.0


def points(angle_rad, radius_m=0.25, noise_m=0.0, seed=0):
    u = cross(AXIS, np.array([0.0, 0.0, 1.0]))
    u = u / np.linalg.norm(u)
    on = Rotation.from_rotvec(angle_rad[:, None] * AXIS).apply(radius_m * u)
    return CENTRE + on + np.random.default_rng(seed).normal(0, noise_m, on.shape)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_without_noise_centre_axis_and_radius_are_exact(sense):
    angle = np.linspace(-1.0, 1.5, 12)
    circle = fit_circle(points(angle), sense * angle)
    assert circle.status is Status.CONVERGED
    assert_allclose(circle.centre_m, CENTRE, atol=1e-10)
    assert_allclose(circle.normal, sense * AXIS, atol=1e-10)
    assert circle.radius_m == pytest.approx(0.25, abs=1e-10)


def test_the_uncertainty_is_that_of_repeated_experiments():
    angle = np.linspace(-0.8, 0.8, 20)
    fits = [fit_circle(points(angle, noise_m=20e-6, seed=s), angle) for s in range(200)]
    centre = np.array([c.centre_m for c in fits])
    tilt = np.array([c.normal @ np.array([2.0, -2.0, -1.0]) / 3.0 for c in fits])
    stated = np.sqrt(np.mean([c.centre_sigma_m**2 for c in fits], axis=0))
    assert_allclose(np.std(centre, axis=0), stated, rtol=0.2)
    assert np.std(tilt) < 1.2 * np.sqrt(np.mean([c.normal_sigma_rad**2 for c in fits]))
    assert np.median([c.scatter_m for c in fits]) == pytest.approx(20e-6, rel=0.1)


def test_a_short_arc_in_noise_has_no_circle():
    angle = np.linspace(0.0, 0.004, 8)
    circle = fit_circle(points(angle, noise_m=20e-6), angle)
    assert circle.status is not Status.CONVERGED
    assert np.isnan(circle.covariance).all()


def test_four_points_are_too_few():
    angle = np.linspace(0, 1, 4)
    with pytest.raises(DataError, match="4 points; at least 5"):
        fit_circle(points(angle), angle)
