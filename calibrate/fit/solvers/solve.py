"""One interface to every solver: method, loss, start and limits in; values, covariance and a named status out.

An `Estimator` keeps method and loss, so that the answer of an identification and its proofs are solved alike.
"""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.least_squares import Ended, Fit, Status, Stop, WeightedRows, covariance_of, promised_gain
from calibrate.fit.solvers.robust import (
    Loss,
    LossKind,
    Run,
    reweighted,
    robust_covariance,
    row_weights,
    total_cost,
)
from calibrate.fit.solvers.trust_region import FAR_START, NEAR_START, DogLegRules, LevenbergRules, dogleg, levenberg
from calibrate.model.parameters import start_values
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
STALL = 1e-4  # of chi2, 1 % of a sigma: a slope that promises more than this was not followed to its end
STALL_SHARE = 1e-8  # of chi2 itself, where residuals are far above the stated noise


class Method(Enum):
    """The algorithm; a new one is one file beside this one, one member here and one branch in `_run`."""

    LEVENBERG = "damped least squares (Levenberg-Marquardt)"
    DOGLEG = "Powell's Dog-Leg"


def solve(
    problem: LeastSquares,
    *,
    method: Method = Method.LEVENBERG,
    loss: Loss = Loss.SQUARE,
    start: Floats | None = None,
    damping: float = FAR_START,
    rules: DogLegRules | None = None,
    max_steps: int = 100,
    tolerance: float = 1e-8,
    covariance: bool = True,
) -> Fit:
    """Least squares, or least loss, from `start` (param,), nominal if None, within the bounds of the parameters.

    `damping` (Levenberg) of the first step: FAR_START or NEAR_START. `rules` (Dog-Leg): all its numbers, `max_steps`
    aside if given. `tolerance`: converged when a full step promises less than this of chi2 (noise is 1, so 1e-8 means
    1e-4 sigma), or less than 1e-4 of it times chi2; Dog-Leg has its own rules and uses it between rounds of weights.
    """
    rows = WeightedRows.of(problem)
    theta = rows.moved(start_values(problem.parameters) if start is None else start, np.zeros(len(rows.free)))
    run = _run(method, LevenbergRules(damping, max_steps, tolerance), rules or DogLegRules(kmax=max_steps))
    robust = loss.kind is not LossKind.SQUARE
    ended = reweighted(rows, theta, loss, run, tolerance) if robust else run(rows, theta)
    return _fit(rows, ended, loss, tolerance, covariance=covariance)


def _run(method: Method, levenberg_rules: LevenbergRules, dogleg_rules: DogLegRules) -> Run:
    if method is Method.DOGLEG:
        return lambda rows, theta: dogleg(rows, theta, dogleg_rules)
    return lambda rows, theta: levenberg(rows, theta, levenberg_rules)


def _fit(rows: WeightedRows, ended: Ended, loss: Loss, tolerance: float, *, covariance: bool) -> Fit:
    parameters, theta = rows.problem.parameters, ended.theta
    robust = loss.kind is not LossKind.SQUARE
    plain = rows.residual(theta) if robust else ended.residual
    data, prior_rows = plain[: len(plain) - len(rows.with_prior)], plain[len(plain) - len(rows.with_prior) :]
    chi2 = float(plain @ plain)
    scaled = None
    if covariance and ended.slope is not None:
        scaled = robust_covariance(rows, theta, loss) if robust else covariance_of(ended.slope)
    at_bound = tuple(parameters[rows.free[i]].name for i in np.flatnonzero(rows.at_bound(theta)))
    return Fit(
        theta,
        parameters,
        _in_full(rows, scaled),
        _status(rows, ended, covariance and scaled is None, bool(at_bound), tolerance),
        chi2,
        len(plain) - len(rows.free),
        ended.steps,
        at_bound if ended.slope is not None else (),
        ended.stop,
        float(total_cost(rows.problem, data, loss) + prior_rows @ prior_rows) if robust else chi2,
        row_weights(rows.problem, data, loss) if robust else None,
    )


def _in_full(rows: WeightedRows, scaled: Floats | None) -> Floats:
    """(param, param) covariance from that of the scaled free parameters."""
    n = len(rows.problem.parameters)
    if scaled is None:
        return np.full((n, n), np.nan)
    out = np.zeros((n, n))
    out[np.ix_(rows.free, rows.free)] = scaled * np.outer(rows.scale, rows.scale)
    return out


def _status(rows: WeightedRows, ended: Ended, dependent: bool, bounded: bool, tolerance: float) -> Status:
    if ended.stop is Stop.NOT_FINITE or ended.slope is None:
        return Status.NOT_FINITE
    if ended.stop in (Stop.STEPS, Stop.ROUNDS):
        return Status.OUT_OF_STEPS
    if dependent:
        return Status.RANK_DEFICIENT
    settled = ended.stop in (Stop.GAIN, Stop.RESIDUAL)  # e3: residuals as small as were asked for
    if not settled and _left_to_gain(rows, ended, ended.slope) > max(tolerance, STALL):
        return Status.STALLED
    return Status.AT_BOUND if bounded else Status.CONVERGED


def _left_to_gain(rows: WeightedRows, ended: Ended, slope: Floats) -> float:
    """What a full step still promises of chi2, less what rounding may make of it."""
    gradient = slope.T @ ended.residual
    active = ~rows.pressed(ended.theta, gradient)
    promised = promised_gain(slope[:, active].T @ slope[:, active], gradient[active])
    return promised - STALL_SHARE * float(ended.residual @ ended.residual)


@dataclass(frozen=True)
class Estimator:
    """A method with a loss, and with the numbers of Dog-Leg where they are not the usual ones."""

    method: Method = Method.LEVENBERG
    loss: Loss = Loss.SQUARE
    rules: DogLegRules | None = None

    @property
    def with_usual_rules(self) -> "Estimator":
        """For figures beside the answer, which limits set for the answer must not cut short."""
        return replace(self, rules=None)

    def fit(self, problem: LeastSquares, start: Floats, damping: float = NEAR_START) -> Fit:
        """From `start` (param,), by default one known to be good."""
        return solve(problem, method=self.method, loss=self.loss, start=start, damping=damping, rules=self.rules)


LEAST_SQUARES = Estimator()
