"""The solver: known minima, priors, bounds, and a named status for every way to end."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from calibrate.fit.solvers import NEAR_START, Status, solve
from calibrate.model.parameters import Parameter
from tests.calibrate.fit.known_minima import Known, powell_singular, rosenbrock, unknowns


def line(x, y, sigma, **more):
    design = np.column_stack([np.ones_like(x), x]) / sigma
    return Known(unknowns(0.0, 0.0, **more), lambda t: design @ t - y / sigma, lambda t: design)


def test_the_curved_valley_is_followed_to_its_end():
    fit = solve(rosenbrock(), tolerance=1e-16)
    assert fit.status is Status.CONVERGED
    np.testing.assert_allclose(fit.theta, [1.0, 1.0], atol=1e-6)


def test_a_minimum_where_the_jacobian_vanishes_is_approached():
    assert solve(powell_singular()).chi2 < 1e-8


def test_covariance_of_a_line_is_the_textbook_one():
    rng = np.random.default_rng(0)
    x = np.linspace(0, 1, 20)
    fit = solve(line(x, 1.0 + 2.0 * x + rng.normal(0, 0.1, 20), 0.1))
    expected = 0.01 * np.linalg.inv([[20, x.sum()], [x.sum(), (x**2).sum()]])
    np.testing.assert_allclose(fit.covariance, expected, rtol=1e-9)
    assert fit.dof == 18
    assert 0.3 < fit.chi2_per_dof < 2.5


def test_a_prior_pulls_by_its_weight():
    curve = Known(
        (Parameter("p0", "1", 1.0, start=1.0, prior=0.5),), lambda t: (t - 3.0) / 1.0, lambda t: np.ones((1, 1))
    )
    fit = solve(curve)
    assert fit.theta[0] == pytest.approx((3.0 * 1.0 + 1.0 * 4.0) / 5.0)
    assert fit.covariance[0, 0] == pytest.approx(1.0 / 5.0)


def test_bounds_hold_and_the_others_go_to_their_best_as_scipy_says():
    fit = solve(rosenbrock(lower=-2.0, upper=0.5), start=np.array([-1.2, 0.4]), tolerance=1e-14)
    curve = rosenbrock()
    reference = least_squares(
        curve.residual, [-1.2, 0.4], jac=curve.jacobian, bounds=([-2, -2], [0.5, 0.5]), xtol=1e-14
    )
    assert fit.status is Status.AT_BOUND
    assert fit.at_bound == ("p0",)
    np.testing.assert_allclose(fit.theta, reference.x, atol=1e-6)


def test_held_parameters_stay_and_have_no_variance():
    curve = rosenbrock()
    held = Known((curve.parameters[0], Parameter("p1", "1", 1.0, start=1.0, free=False)), curve.function, curve.slope)
    fit = solve(held)
    assert fit.theta[1] == 1.0
    assert fit.covariance[1, 1] == 0.0


def test_dependent_columns_end_as_rank_deficient_without_covariance():
    curve = Known(unknowns(0.0, 0.0), lambda t: [t[0] + t[1] - 1.0] * 3, lambda t: np.ones((3, 2)))
    fit = solve(curve)
    assert fit.status is Status.RANK_DEFICIENT
    assert np.isnan(fit.covariance).all()


def test_too_few_steps_are_said():
    assert solve(rosenbrock(), max_steps=2).status is Status.OUT_OF_STEPS


def test_a_residual_that_is_not_finite_is_said():
    curve = Known(unknowns(0.0), lambda t: [np.inf], lambda t: np.ones((1, 1)))
    assert solve(curve).status is Status.NOT_FINITE


def test_a_good_start_needs_few_steps():
    fit = solve(rosenbrock(), start=np.array([1.0 + 1e-6, 1.0]), damping=NEAR_START)
    assert fit.steps <= 2
