"""What the readings leave over: equations less unknowns, where a prior carries part of an unknown."""

from dataclasses import dataclass

import numpy as np
import pytest

from calibrate.fit.accuracy import checks_nothing, spare_readings
from calibrate.fit.solvers import solve
from calibrate.model.parameters import Parameter


@dataclass(frozen=True)
class Line:
    """Whitened straight line through noisy points, with as many powers as parameters."""

    parameters: tuple
    x: np.ndarray
    y: np.ndarray

    def residual(self, theta):
        return self.jacobian(theta) @ theta - self.y

    def jacobian(self, theta):
        return np.stack([self.x**k for k in range(len(theta))], axis=1)


def fitted(rows, unknowns, prior=np.inf):
    rng = np.random.default_rng(rows)
    parameters = tuple(Parameter(f"p{k}", "m", 1.0, prior=prior) for k in range(unknowns))
    problem = Line(parameters, np.linspace(-1.0, 1.0, rows), rng.normal(size=rows))
    fit = solve(problem)
    return problem, fit


@pytest.mark.parametrize(("rows", "unknowns"), [(12, 12), (12, 4), (40, 3)])
def test_without_priors_it_is_equations_less_unknowns(rows, unknowns):
    problem, fit = fitted(rows, unknowns)
    assert spare_readings(problem, fit.theta, fit.covariance) == pytest.approx(rows - unknowns, abs=1e-4)


def test_priors_are_no_readings():
    problem, fit = fitted(12, 12, prior=1.0)
    assert fit.dof == 12  # twelve rows of priors count there
    assert 0.0 < spare_readings(problem, fit.theta, fit.covariance) < 12.0


def test_what_the_drawing_fixes_leaves_all_readings_over():
    problem, fit = fitted(12, 12, prior=1e-6)
    assert spare_readings(problem, fit.theta, fit.covariance) == pytest.approx(12.0, abs=1e-6)


def test_as_many_equations_as_unknowns_check_nothing():
    problem, fit = fitted(12, 12)
    assert checks_nothing(spare_readings(problem, fit.theta, fit.covariance))
    assert not checks_nothing(20.0)


def test_without_a_covariance_it_is_not_known():
    problem, fit = fitted(12, 3)
    assert np.isnan(spare_readings(problem, fit.theta, np.full((3, 3), np.nan)))
