"""Damped least squares on normal equations: the algorithm, statuses and figures of calibrate.solvers.

Normal equations square the condition: what rank needs comes from a QR triangle before, and the covariance falls back to
one where the normal matrix has lost too many digits. Bounds are not for this loop.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from calibrate.kernels.normal_equations import Normal, NormalRows
from calibrate.parameters import Parameter
from calibrate.solvers.levenberg import (
    DAMPING_LIMIT,
    ENOUGH,
    NEAR_START,
    QUICKER,
    ROUNDING,
    UNMEASURABLE,
    LevenbergRules,
)
from calibrate.solvers.linear import covariance_of, damped_step, promised_gain
from calibrate.solvers.result import Fit, Status, Stop
from calibrate.solvers.solve import STALL, STALL_SHARE

Floats = NDArray[np.float64]

LOST = 1e-5  # of a pivot of the normal matrix with unit diagonal: its inverse has six digits left


def bounded(parameters: tuple[Parameter, ...]) -> bool:
    """Whether a free parameter has a bound, which this loop would not respect."""
    return any(p.free and (math.isfinite(p.lower) or math.isfinite(p.upper)) for p in parameters)


def fit_normal(rows: NormalRows, theta: Floats, now: Normal, rules: LevenbergRules) -> Fit:
    """From theta (param,), where the normal equations are `now`; the loop of solvers/levenberg.py."""
    damping, growth, scaled = rules.damping, 2.0, rows.scaled
    for steps in range(rules.max_steps):
        if not now.finite:
            return _end(rows, theta, now, Stop.NOT_FINITE, steps, rules)
        step = damped_step(now.matrix, now.gradient, damping)
        promised = _promise(now, step, damping)
        if promised < max(rules.tolerance, max(ENOUGH * rules.tolerance, ROUNDING) * now.chi2):
            return _end(rows, theta, now, Stop.GAIN, steps, rules)
        if damping > DAMPING_LIMIT:
            return _end(rows, theta, now, Stop.DAMPING, steps, rules)
        trial = theta.copy()
        trial[scaled.free] += step * scaled.scale
        new = rows.normal(trial)
        gain = _gain_ratio(now, new, step, promised)
        if gain > 0.0:
            theta, now, growth = trial, new, 2.0
            damping *= max(QUICKER, 1.0 - (2.0 * gain - 1.0) ** 3)
        else:
            damping *= growth
            growth *= 2.0
    return _end(rows, theta, now, Stop.STEPS, rules.max_steps, rules)


def _promise(now: Normal, step: Floats, damping: float) -> float:
    """Decrease of chi2 by a full step; a step that is all but undamped is one."""
    return float(-now.gradient @ step) if damping <= NEAR_START else promised_gain(now.matrix, now.gradient)


def _gain_ratio(now: Normal, new: Normal, step: Floats, promised: float) -> float:
    """Actual over predicted decrease; -1 where the new point is not finite, 1 where both are lost in rounding."""
    if not new.finite:
        return -1.0
    actual = now.chi2 - new.chi2
    if max(promised, abs(actual)) < UNMEASURABLE * now.chi2:
        return 1.0
    predicted = float(-2.0 * (now.gradient @ step) - step @ now.matrix @ step)
    return actual / predicted if predicted > 0.0 else -1.0


def _end(rows: NormalRows, theta: Floats, normal: Normal, stop: Stop, steps: int, rules: LevenbergRules) -> Fit:
    scaled = rows.scaled
    found = None if stop is Stop.NOT_FINITE else _covariance(rows, theta, normal)
    dof = rows.residuals + scaled.believed - len(scaled.free)
    status = _status(normal, stop, rules, dependent=found is None)
    covariance = scaled.in_full(found)
    return Fit(theta, scaled.parameters, covariance, status, normal.chi2, dof, steps, stop=stop, cost=normal.chi2)


def _status(normal: Normal, stop: Stop, rules: LevenbergRules, *, dependent: bool) -> Status:
    if stop is Stop.NOT_FINITE:
        return Status.NOT_FINITE
    if stop is Stop.STEPS:
        return Status.OUT_OF_STEPS
    if dependent:
        return Status.RANK_DEFICIENT
    if stop is Stop.DAMPING:
        left = promised_gain(normal.matrix, normal.gradient) - STALL_SHARE * normal.chi2
        return Status.STALLED if left > max(rules.tolerance, STALL) else Status.CONVERGED
    return Status.CONVERGED


def _covariance(rows: NormalRows, theta: Floats, normal: Normal) -> Floats | None:
    """(free, free) in scaled columns; None when the columns are dependent."""
    if len(normal.gradient) == 0:
        return np.zeros((0, 0))
    potrf, potri = lapack.dpotrf, lapack.dpotri  # pyright: ignore[reportAttributeAccessIssue] - not in the stubs
    unit = 1.0 / np.sqrt(np.maximum(np.diag(normal.matrix), np.finfo(float).tiny))
    units = unit[:, None] * unit
    L, indefinite = potrf(normal.matrix * units, lower=True)
    if indefinite or np.min(np.diag(L)) < LOST:
        return covariance_of(rows.scaled.with_priors(rows.triangle(theta)[:, rows.scaled.free]))
    lower = np.tril(potri(L, lower=True)[0])
    return (lower + np.tril(lower, -1).T) * units
