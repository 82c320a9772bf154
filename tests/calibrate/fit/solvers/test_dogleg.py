"""Dog-Leg: each stopping rule by name, the two legs, and the radius."""

from dataclasses import dataclass

import numpy as np
import pytest

from calibrate.fit.solvers import (
    DogLegRules,
    Method,
    Status,
    Stop,
    solve,
)
from calibrate.fit.solvers.least_squares import gauss_newton_step
from calibrate.fit.solvers.trust_region import dogleg_step, next_radius, second_leg
from calibrate.model.parameters import Parameter


@dataclass(frozen=True)
class Line:
    """r = A theta - b."""

    parameters: tuple[Parameter, ...]
    A: np.ndarray
    b: np.ndarray

    def residual(self, theta):
        return self.A @ theta - self.b

    def jacobian(self, theta):
        return self.A


def line(A, b, start=0.0):
    A = np.array(A, dtype=float)
    return Line(
        tuple(Parameter(f"p{i}", "1", 1.0, start=start) for i in range(A.shape[1])), A, np.array(b, dtype=float)
    )


@dataclass(frozen=True)
class Kink:
    """r = |theta|^(1/2) + 1 with a slope that promises far too much near its lowest point."""

    parameters: tuple[Parameter, ...]

    def residual(self, theta):
        return np.sqrt(np.abs(theta)) + 1.0

    def jacobian(self, theta):
        return np.array([[0.5 * np.sign(theta[0] or 1.0) / np.sqrt(max(abs(theta[0]), 1e-300))]])


def stops(problem, **rules):
    return solve(problem, method=Method.DOGLEG, rules=DogLegRules(**rules))


def test_a_vanishing_gradient_stops_by_e1():
    fit = stops(line([[1.0], [1.0]], [0.0, 2.0]), e1=1e-6, e3=0.0)
    assert (fit.stop, fit.status) == (Stop.GRADIENT, Status.CONVERGED)
    assert fit.theta[0] == pytest.approx(1.0)


def test_a_vanishing_residual_stops_by_e3():
    fit = stops(line([[1.0]], [2.0], start=2.0 + 1e-7), e1=1e-9, e3=1e-6)
    assert (fit.stop, fit.status) == (Stop.RESIDUAL, Status.CONVERGED)


def test_e3_is_a_bound_of_the_2_norm_as_in_the_source():
    four = line([[1.0]] * 4, [2.0] * 4, start=2.0 + 1e-6)  # each residual 1e-6, their 2-norm 2e-6
    longer, shorter = stops(four, e1=0.0, e3=2.1e-6), stops(four, e1=0.0, e3=1.5e-6)
    assert (longer.stop, longer.steps) == (Stop.RESIDUAL, 0)
    assert shorter.steps == 1  # the largest of the four is below the limit, their norm is not


def test_sigma_is_the_threshold_of_the_radius_and_every_gain_is_taken():
    kink = Kink((Parameter("p0", "1", 1.0, start=0.01),))
    for sigma in (0.0, 0.5):  # across the kink: 0.4 of what the slope promises
        assert stops(kink, kmax=1, radius=0.015, sigma=sigma).theta[0] == pytest.approx(-0.005)
    assert (next_radius(2.0, 0.4, 1.0, sigma=0.5), next_radius(2.0, 0.4, 1.0, sigma=0.25)) == (1.0, 2.0)
    assert next_radius(2.0, 0.0, 1.0, sigma=0.0) == 1.0  # else a refused step would be tried again


def test_e3_is_a_success_whatever_a_further_step_would_gain():
    fit = stops(line([[1.0]], [2.0], start=1.0), e3=5.0)
    assert (fit.stop, fit.status, fit.steps) == (Stop.RESIDUAL, Status.CONVERGED, 0)


def test_messages_name_the_keys_of_a_plan():
    assert "kmax" in Stop.STEPS.value
    assert "kmax" in Status.OUT_OF_STEPS.value
    assert "max_steps" not in Status.OUT_OF_STEPS.value


def test_a_small_step_stops_by_e2():
    fit = stops(line([[1.0], [1.0]], [1.0, 1.0 + 1e-9], start=1.0), e1=0.0, e2=1e-6, e3=0.0)
    assert (fit.stop, fit.steps) == (Stop.STEP, 0)


def test_a_shrunken_radius_stops_by_e2_and_is_not_called_convergence():
    fit = stops(Kink((Parameter("p0", "1", 1.0, start=1e-8),)), e2=1e-3, radius=0.5)
    assert (fit.stop, fit.status) == (Stop.RADIUS, Status.STALLED)


def test_kmax_stops_and_says_so():
    fit = stops(line(np.eye(2), [50.0, 50.0]), kmax=3, radius=1e-3)
    assert (fit.stop, fit.status, fit.steps) == (Stop.STEPS, Status.OUT_OF_STEPS, 3)


def test_every_ending_has_a_sentence_of_its_own():
    assert len({stop.value for stop in Stop}) == len(Stop)


def test_inside_the_radius_the_step_is_that_of_gauss_newton():
    A, e = np.array([[2.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), np.array([1.0, 2.0, -1.0])
    step = dogleg_step(A, gauss_newton_step(A, e), A.T @ e, 100.0)
    np.testing.assert_allclose(step, np.linalg.lstsq(A, -e)[0])


def test_a_short_radius_goes_straight_down_the_gradient():
    A, e = np.array([[2.0, 0.0], [0.0, 1.0]]), np.array([3.0, 4.0])
    g = A.T @ e
    np.testing.assert_allclose(dogleg_step(A, gauss_newton_step(A, e), g, 0.1), -0.1 * g / np.linalg.norm(g))


def test_between_the_two_the_step_ends_on_the_radius_and_on_the_second_leg():
    A, e = np.diag([10.0, 1.0]), np.array([10.0, 8.0])
    g = A.T @ e
    cauchy, newton = -g * (g @ g) / np.sum((A @ g) ** 2), -np.array([1.0, 8.0])
    radius = 0.5 * (np.linalg.norm(cauchy) + np.linalg.norm(newton))
    step = dogleg_step(A, newton, g, radius)
    assert np.linalg.norm(step) == pytest.approx(radius)
    way, gone = newton - cauchy, step - cauchy
    assert way[0] * gone[1] - way[1] * gone[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("newton", [[3.0, 4.0], [-30.0, 1.0]])
def test_the_second_leg_meets_the_radius_whatever_its_angle(newton):
    cauchy, newton = np.array([0.6, 0.1]), np.array(newton)
    beta = second_leg(cauchy, newton, 1.5)
    assert 0.0 < beta < 1.0
    assert np.linalg.norm(cauchy + beta * (newton - cauchy)) == pytest.approx(1.5)


def test_what_no_row_sees_is_left_where_it_is():
    A, e = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]), np.array([2.0, 2.0])
    np.testing.assert_allclose(gauss_newton_step(A, e), [-1.0, -1.0, 0.0], atol=1e-14)


@pytest.mark.parametrize(
    ("gain", "length", "after"), [(0.9, 1.0, 3.0), (0.9, 0.1, 2.0), (0.5, 1.0, 2.0), (0.1, 1.0, 1.0), (-1.0, 1.0, 1.0)]
)
def test_the_radius_follows_the_gain(gain, length, after):
    assert next_radius(2.0, gain, length) == after
