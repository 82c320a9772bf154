"""Fast identification from tracked positions: what the data see first, then damped least squares on normal equations.

The same algorithm, statuses and figures as calibrate.fit.solve; only the rows are never held, so that cost is linear
and memory constant in the poses. Normal equations square the condition: what rank needs comes from a QR triangle
before, and the covariance falls back to one where the normal matrix has lost too many digits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve, cholesky

from calibrate.errors import DataError
from calibrate.fit import FAR_START, NEAR_START, Fit, Status, Stop, covariance_of, solve
from calibrate.identifiability import Identifiability, analyse
from calibrate.kernels.position_rows import Normal, PositionRows
from calibrate.parameters import hold, start_values
from calibrate.problem import Problem
from calibrate.solvers.levenberg import DAMPING_LIMIT, ENOUGH, QUICKER, ROUNDING, LevenbergRules
from calibrate.solvers.linear import damped_step, promised_gain

Floats = NDArray[np.float64]

UNMEASURABLE = 1e-13  # of chi2: a difference of two such sums is rounding
LOST = 1e-5  # of a pivot of the normal matrix with unit diagonal: its inverse has six digits left


@dataclass(frozen=True)
class Identified:
    """What the data see at the start, and the fit with the rest held."""

    seen: Identifiability | None  # None where the start is not finite, which the fit says
    fit: Fit


def identify_positions(problem: Problem, *, start: Floats | None = None, damping: float = NEAR_START) -> Identified:
    """Rank first, one parameter of every unseen combination held at `start` (param,), nominal if None; then the fit.

    The rank is full by then, so NEAR_START is safe as damping. DataError unless the problem is a serial arm with a
    position instrument and has poses.
    """
    theta = start_values(problem.parameters) if start is None else start
    triangle = _rows_of(problem).triangle(theta)
    if not np.all(np.isfinite(triangle)):
        return Identified(None, fit_positions(problem, start=theta, damping=damping))
    seen = analyse(triangle[:, :-1], problem.parameters)
    held = problem.with_parameters(hold(problem.parameters, (c.representative for c in seen.combinations)))
    if _bounded(held):
        return Identified(seen, solve(held, start=theta, damping=damping))
    rows = _rows_of(held)
    return Identified(seen, _levenberg(rows, theta, rows.normal_of(theta, triangle), LevenbergRules(damping)))


def fit_positions(
    problem: Problem,
    *,
    start: Floats | None = None,
    damping: float = FAR_START,
    max_steps: int = 100,
    tolerance: float = 1e-8,
) -> Fit:
    """As calibrate.fit.solve, which also does the work where parameters have bounds. DataError as above."""
    rows = _rows_of(problem)
    if _bounded(problem):
        return solve(problem, start=start, damping=damping, max_steps=max_steps, tolerance=tolerance)
    theta = start_values(problem.parameters) if start is None else start
    return _levenberg(rows, theta, rows.normal(theta), LevenbergRules(damping, max_steps, tolerance))


def _levenberg(rows: PositionRows, theta: Floats, now: Normal, rules: LevenbergRules) -> Fit:
    """The loop of solvers/levenberg.py, on normal equations."""
    damping, growth = rules.damping, 2.0
    for steps in range(rules.max_steps):
        if not _finite(now):
            return _end(rows, theta, now, Stop.NOT_FINITE, steps)
        step = damped_step(now.matrix, now.gradient, damping)
        if _promise(now, step, damping) < max(rules.tolerance, max(ENOUGH * rules.tolerance, ROUNDING) * now.chi2):
            return _end(rows, theta, now, Stop.GAIN, steps)
        if damping > DAMPING_LIMIT:
            return _end(rows, theta, now, Stop.DAMPING, steps)
        trial = theta.copy()
        trial[rows.free] += step * rows.scale
        new = rows.normal(trial)
        gain = _gain_ratio(now, new, step)
        if gain > 0.0:
            theta, now, growth = trial, new, 2.0
            damping *= max(QUICKER, 1.0 - (2.0 * gain - 1.0) ** 3)
        else:
            damping *= growth
            growth *= 2.0
    return _end(rows, theta, now, Stop.STEPS, rules.max_steps)


def _promise(now: Normal, step: Floats, damping: float) -> float:
    """Decrease of chi2 by a full step; a step that is all but undamped is one."""
    return float(-now.gradient @ step) if damping <= NEAR_START else promised_gain(now.matrix, now.gradient)


def _bounded(problem: Problem) -> bool:
    return any(p.free and (np.isfinite(p.lower) or np.isfinite(p.upper)) for p in problem.parameters)


def _rows_of(problem: Problem) -> PositionRows:
    rows = PositionRows.of(problem)
    if rows is None:
        raise DataError(
            "positions: the problem is not a serial arm with a position instrument; use calibrate.fit.solve"
        )
    if problem.rows == 0:
        raise DataError("positions: no poses at all; record settled samples with x_m, y_m, z_m")
    return rows


def _finite(normal: Normal) -> bool:
    return bool(np.isfinite(normal.chi2) and np.all(np.isfinite(normal.matrix)))


def _gain_ratio(now: Normal, new: Normal, step: Floats) -> float:
    """Actual over predicted decrease; -1 where the new point is not finite, 1 where both are lost in rounding."""
    if not _finite(new):
        return -1.0
    predicted = float(-2.0 * (now.gradient @ step) - step @ now.matrix @ step)
    actual = now.chi2 - new.chi2
    if predicted <= 0.0:
        return -1.0
    return 1.0 if max(predicted, abs(actual)) < UNMEASURABLE * now.chi2 else actual / predicted


def _end(rows: PositionRows, theta: Floats, normal: Normal, stop: Stop, steps: int) -> Fit:
    parameters = rows.problem.parameters
    covariance = np.full((len(theta), len(theta)), np.nan)
    scaled = None if stop is Stop.NOT_FINITE else _covariance(rows, theta, normal)
    if scaled is not None:
        covariance[:] = 0.0
        covariance[np.ix_(rows.free, rows.free)] = scaled * np.outer(rows.scale, rows.scale)
    dof = 3 * len(rows.q_rad) + int(np.sum(rows.information > 0.0)) - len(rows.free)
    status = _status(stop, dependent=scaled is None)
    return Fit(theta, parameters, covariance, status, normal.chi2, dof, steps, stop=stop, cost=normal.chi2)


def _status(stop: Stop, *, dependent: bool) -> Status:
    if stop is Stop.NOT_FINITE:
        return Status.NOT_FINITE
    if stop is Stop.STEPS:
        return Status.OUT_OF_STEPS
    if dependent:
        return Status.RANK_DEFICIENT
    return Status.STALLED if stop is Stop.DAMPING else Status.CONVERGED


def _covariance(rows: PositionRows, theta: Floats, normal: Normal) -> Floats | None:
    """(free, free) in scaled columns; None when the columns are dependent."""
    unit = 1.0 / np.sqrt(np.maximum(np.diag(normal.matrix), np.finfo(float).tiny))
    try:
        L = cholesky(normal.matrix * np.outer(unit, unit), lower=True)
    except LinAlgError:
        return _covariance_by_rows(rows, theta)
    if len(L) and np.min(np.diag(L)) < LOST:
        return _covariance_by_rows(rows, theta)
    return cho_solve((L, True), np.eye(len(L))) * np.outer(unit, unit)


def _covariance_by_rows(rows: PositionRows, theta: Floats) -> Floats | None:
    data = rows.triangle(theta)[:, :-1][:, rows.free] * rows.scale
    return covariance_of(np.concatenate([data, np.diag(np.sqrt(rows.information))]))
