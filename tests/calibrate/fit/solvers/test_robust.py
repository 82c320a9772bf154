"""Robust losses: their slopes, their answer among blunders, and a covariance that keeps its word."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import least_squares

from calibrate.fit.solvers import (
    Loss,
    Method,
    Status,
    solve,
)
from calibrate.model.parameters import Parameter

LOSSES = (Loss.SQUARE, Loss.HUBER, Loss.CAUCHY, Loss.STUDENT_T, Loss.student_t(2.0))
ROBUST = LOSSES[1:]
DRAWS = pytest.mark.parametrize("draws", [100, pytest.param(400, marks=pytest.mark.endure)])


@dataclass(frozen=True)
class Curve:
    """y = a exp(b x), whitened by the stated sigma."""

    parameters: tuple[Parameter, ...]
    x: np.ndarray
    y: np.ndarray
    sigma: float

    def residual(self, theta):
        return (theta[0] * np.exp(theta[1] * self.x) - self.y) / self.sigma

    def jacobian(self, theta):
        e = np.exp(theta[1] * self.x)
        return np.column_stack([e, theta[0] * self.x * e]) / self.sigma


def curve(rng, n=60, bad=0, sigma=0.05):
    x = np.linspace(0.0, 1.0, n)
    y = 2.0 * np.exp(-1.0 * x) + rng.normal(0.0, sigma, n)
    y[rng.choice(n, bad, replace=False)] += rng.uniform(1.0, 3.0, bad)
    return Curve((Parameter("a", "1", 1.0, start=1.0), Parameter("b", "1", 1.0)), x, y, sigma)


@pytest.mark.parametrize("loss", LOSSES, ids=str)
def test_weight_and_curvature_are_the_slopes_of_the_cost(loss):
    z = np.array([-7.1, -1.3, -0.4, 0.2, 1.0, 2.2, 9.0])
    h = 1e-5
    slope = (loss.cost(z + h) - loss.cost(z - h)) / (2.0 * h)
    np.testing.assert_allclose(loss.weight(z) * z, slope / 2.0, rtol=1e-8)
    bend = (loss.weight(z + h) * (z + h) - loss.weight(z - h) * (z - h)) / (2.0 * h)
    np.testing.assert_allclose(loss.curvature(z), bend, atol=1e-8)
    assert loss.cost(np.array([1e-4]))[0] == pytest.approx(1e-8 * loss.weight(np.zeros(1))[0], rel=1e-6)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("loss", ROBUST, ids=str)
def test_gross_errors_do_not_move_the_answer(loss, method):
    problem = curve(np.random.default_rng(1), bad=9)
    fit = solve(problem, loss=loss, method=method)
    assert fit.status is Status.CONVERGED
    np.testing.assert_allclose(fit.theta, [2.0, -1.0], atol=0.1)
    assert np.abs(solve(problem).theta - [2.0, -1.0]).max() > 0.15
    worst = np.argsort(fit.weights)[:9]
    assert np.all(problem.residual(np.array([2.0, -1.0]))[worst] < -10.0)


@pytest.mark.parametrize("loss", [Loss.HUBER, Loss.CAUCHY], ids=str)
def test_scipy_finds_the_same_minimum_of_the_loss(loss):
    problem = curve(np.random.default_rng(2), bad=5)
    fit = solve(problem, loss=loss, tolerance=1e-16)
    witness = least_squares(
        problem.residual,
        fit.theta + 0.05,
        jac=problem.jacobian,
        loss=loss.kind.name.lower(),
        f_scale=loss.width,
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-12,
    )
    assert fit.cost == pytest.approx(2.0 * witness.cost, rel=1e-9)
    np.testing.assert_allclose(fit.theta, witness.x, atol=1e-6)


def test_student_t_is_the_most_likely_answer_under_its_law():
    problem = curve(np.random.default_rng(3), bad=5)
    fit = solve(problem, loss=Loss.student_t(3.0), tolerance=1e-16)
    for step in 1e-4 * np.concatenate([np.eye(2), -np.eye(2)]):
        z = problem.residual(fit.theta + step)
        assert np.sum(4.0 * np.log1p(z**2 / 3.0)) > fit.cost


@DRAWS
@pytest.mark.parametrize("loss", [Loss.HUBER, Loss.CAUCHY, Loss.STUDENT_T], ids=str)
def test_sigma_is_the_scatter_of_the_answers_when_a_tenth_of_the_rows_is_noisier(loss, draws):
    rng, z = np.random.default_rng(4), []
    for _ in range(draws):
        problem = curve(rng)
        rough = rng.uniform(size=60) < 0.1
        problem.y[rough] += rng.normal(0.0, 5.0 * 0.05, int(rough.sum()))
        fit = solve(problem, loss=loss)
        z.append((fit.theta - [2.0, -1.0]) / np.sqrt(np.diag(fit.covariance)))
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.1)


def test_a_prior_pulls_a_robust_fit_as_it_pulls_a_plain_one():
    rng = np.random.default_rng(5)
    problem = curve(rng, sigma=1.0)
    held = Curve((problem.parameters[0], Parameter("b", "1", 1.0, start=-1.0, prior=1e-3)), problem.x, problem.y, 1.0)
    fit = solve(held, loss=Loss.HUBER)
    assert fit.theta[1] == pytest.approx(-1.0, abs=3e-3)
    assert np.sqrt(fit.covariance[1, 1]) == pytest.approx(1e-3, rel=0.05)


def test_a_width_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match="STUDENT_T loss: width 0"):
        Loss.student_t(0.0)


@dataclass(frozen=True)
class Points:
    """A point (3,) seen many times with unit noise: three values an observation, or each value for itself."""

    seen: np.ndarray  # (obs, 3)

    parameters = tuple(Parameter(a, "m", 1.0) for a in "xyz")

    def residual(self, theta):
        return (theta - self.seen).ravel()

    def jacobian(self, theta):
        return np.tile(np.eye(3), (len(self.seen), 1))


class WholePoints(Points):
    @property
    def row_widths(self):
        return np.full(len(self.seen), 3)


@pytest.mark.parametrize("loss", ROBUST, ids=str)
def test_a_bad_shot_is_distrusted_in_all_its_coordinates(loss):
    rng = np.random.default_rng(6)
    seen = rng.normal(0.0, 1.0, (80, 3))
    seen[7, 0] += 100.0
    weights = solve(WholePoints(seen), loss=loss).weights.reshape(80, 3)
    np.testing.assert_array_equal(weights, weights[:, :1] * np.ones(3))
    assert weights[7, 2] < 0.06
    assert solve(Points(seen), loss=loss).weights.reshape(80, 3)[7, 2] > 0.5


@pytest.mark.parametrize("loss", ROBUST, ids=str)
def test_the_answer_does_not_depend_on_the_axes_of_an_observation(loss):
    rng = np.random.default_rng(7)
    seen = rng.standard_t(2, (60, 3)) + np.arange(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    straight = solve(WholePoints(seen), loss=loss, tolerance=1e-14).theta
    turned = solve(WholePoints(seen @ turn.T), loss=loss, tolerance=1e-14).theta
    np.testing.assert_allclose(turn @ straight, turned, atol=1e-7)


# Daily for the other losses: single rows, above.
MORE = [pytest.param(loss, marks=pytest.mark.endure) for loss in (Loss.CAUCHY, Loss.STUDENT_T)]


@DRAWS
@pytest.mark.parametrize("loss", [Loss.HUBER, *MORE], ids=str)
def test_sigma_of_whole_observations_is_the_scatter_of_the_answers(loss, draws):
    rng, z = np.random.default_rng(8), []
    for _ in range(draws):
        size = np.where(rng.uniform(size=(40, 1)) < 0.1, 5.0, 1.0)
        fit = solve(WholePoints(size * rng.normal(size=(40, 3))), loss=loss)
        z.append(fit.theta / np.sqrt(np.diag(fit.covariance)))
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("loss", [Loss.HUBER, Loss.CAUCHY], ids=str)
def test_as_many_good_observations_bend_whatever_their_width(loss):
    rng = np.random.default_rng(9)
    k = np.array([1, 3, 6])
    lengths = [np.linalg.norm(rng.normal(size=(200_000, n)), axis=1) for n in k]
    beyond = [float(np.mean(z > bend)) for z, bend in zip(lengths, loss.bend(k), strict=True)]
    np.testing.assert_allclose(beyond, beyond[0], atol=4.0 * np.sqrt(beyond[0] / 200_000))
