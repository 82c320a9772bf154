"""Damped least squares (Levenberg-Marquardt) with column scaling, priors as rows, bounds, and a named status.

Sources: Marquardt, J. SIAM 11(2), 1963 (damping in scaled columns); Madsen, Nielsen, Tingleff, Methods for non-linear
least squares problems, 2nd ed. 2004, alg. 3.16 (damping by the gain ratio). Bounds: a step is clipped to them, and a
parameter at its bound whose gradient pushes outwards is left out of the step (projected Newton, Bertsekas, SIAM J.
Control Optim. 20(2), 1982).
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_triangular

from calibrate.parameters import Parameter, plausible_sizes, priors, start_values
from calibrate.problem import LeastSquares

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FAR_START = 1e-3  # damping, of the largest diagonal element: Madsen et al. for a start that may be far off
NEAR_START = 1e-12  # for a start known to be good: the first step is all but a Gauss-Newton step
QUICKER = 0.01  # smallest factor on the damping; the book's 1/3 creeps along weak directions of these problems
DAMPING_LIMIT = 1e12  # no step helps any more: the residual is at its rounding floor


class Status(Enum):
    """How a fit ended; the value is the sentence for a person."""

    CONVERGED = "predicted gain is below tolerance"
    OUT_OF_STEPS = "step limit reached; raise max_steps or improve the start"
    RANK_DEFICIENT = "data cannot fix some combinations of parameters; they are held and named"
    AT_BOUND = "a parameter is at its bound: the question is not answered by these data"
    NOT_FINITE = "residual became infinite or undefined; check joint signs, the order of reflection and the rig"


@dataclass(frozen=True)
class Fit:
    """Values at the end, with their covariance where the free columns are of full rank."""

    theta: Floats  # (param,)
    parameters: tuple[Parameter, ...]
    covariance: Floats  # (param, param), zero for held ones, nan where it does not exist
    status: Status
    chi2: float  # of data and prior rows
    dof: int  # data and prior rows less free parameters
    steps: int
    at_bound: tuple[str, ...] = ()

    @property
    def chi2_per_dof(self) -> float:
        """Near 1 when the model and the stated noise agree; nan without redundancy."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")


class _Rows:
    """Data rows and prior rows of the free parameters, in columns scaled by plausible sizes."""

    def __init__(self, problem: LeastSquares) -> None:
        self.problem = problem
        parameters = problem.parameters
        self.free = np.flatnonzero([p.free for p in parameters])
        self.scale = plausible_sizes(parameters)[self.free]
        self.believed = np.flatnonzero(np.isfinite(priors(parameters)[self.free]))
        self.prior = priors(parameters)[self.free][self.believed]
        self.centre = start_values(parameters)[self.free][self.believed]
        self.lower = np.array([p.lower for p in parameters])[self.free]
        self.upper = np.array([p.upper for p in parameters])[self.free]
        self.prior_rows = np.zeros((len(self.believed), len(self.free)))
        self.prior_rows[range(len(self.believed)), self.believed] = self.scale[self.believed] / self.prior

    def residual(self, theta: Floats) -> Floats:
        believed = (theta[self.free][self.believed] - self.centre) / self.prior
        return np.concatenate([self.problem.residual(theta), believed])

    def jacobian(self, theta: Floats) -> Floats:
        data = self.problem.jacobian(theta)[:, self.free] * self.scale
        return np.concatenate([data, self.prior_rows])

    def moved(self, theta: Floats, step: Floats) -> Floats:
        """Theta after a scaled step, clipped to the bounds."""
        out = theta.copy()
        out[self.free] = np.clip(theta[self.free] + step * self.scale, self.lower, self.upper)
        return out

    def pressed(self, theta: Floats, gradient: Floats) -> Bools:
        """(free,) at a bound with descent pointing out of it."""
        value = theta[self.free]
        return ((value <= self.lower) & (gradient > 0.0)) | ((value >= self.upper) & (gradient < 0.0))


def solve(
    problem: LeastSquares,
    *,
    start: Floats | None = None,
    damping: float = FAR_START,
    max_steps: int = 100,
    tolerance: float = 1e-8,
) -> Fit:
    """Least squares from `start` (param,), nominal if None; `damping` of the first step, FAR_START or NEAR_START.

    `tolerance`: the fit has converged when a full step promises less than this of chi2 (noise is 1, so 1e-8 means
    1e-4 sigma), or less than 1e-12 of chi2 itself.
    """
    rows = _Rows(problem)
    theta = rows.moved(start_values(problem.parameters) if start is None else start, np.zeros(len(rows.free)))
    residual = rows.residual(theta)
    if not np.all(np.isfinite(residual)):
        return _end(rows, theta, residual, None, Status.NOT_FINITE, 0)
    slope = rows.jacobian(theta)
    growth = 2.0
    for steps in range(max_steps):
        gradient = slope.T @ residual
        active = ~rows.pressed(theta, gradient)
        normal = slope[:, active].T @ slope[:, active]
        target = max(tolerance, 1e-12 * float(residual @ residual))
        if _full_gain(normal, gradient[active]) < target or damping > DAMPING_LIMIT:
            return _end(rows, theta, residual, slope, Status.CONVERGED, steps)
        step = np.zeros(len(rows.free))
        step[active] = _damped_step(normal, gradient[active], damping)
        trial = rows.moved(theta, step)
        new = rows.residual(trial)
        gain = _gain_ratio(residual, new, slope @ ((trial - theta)[rows.free] / rows.scale))
        if gain > 0.0:
            theta, residual, slope = trial, new, rows.jacobian(trial)
            damping *= max(QUICKER, 1.0 - (2.0 * gain - 1.0) ** 3)
            growth = 2.0
        else:
            damping *= growth
            growth *= 2.0
    return _end(rows, theta, residual, slope, Status.OUT_OF_STEPS, max_steps)


def _damped_step(normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Step of the damped normal equations, -(N + damping max(diag N) 1)^-1 g.

    The ridge in scaled columns keeps combinations that the data cannot see where they are.
    """
    if len(gradient) == 0:
        return np.zeros(0)
    ridge = max(damping, 1e-15) * float(np.max(np.diag(normal)))
    for _ in range(60):
        try:
            return -cho_solve(cho_factor(normal + ridge * np.eye(len(gradient)), lower=True), gradient)
        except LinAlgError:  # rounding made it indefinite
            ridge *= 10.0
    raise ArithmeticError(f"normal equations of {len(gradient)} parameters are not finite; check the weights")


def _full_gain(normal: Floats, gradient: Floats) -> float:
    """Decrease of chi2 that an (almost) undamped step promises."""
    return float(-gradient @ _damped_step(normal, gradient, 0.0)) if len(gradient) else 0.0


def _gain_ratio(old: Floats, new: Floats, change: Floats) -> float:
    """Actual over predicted decrease; -1 where the new residual is not finite."""
    if not np.all(np.isfinite(new)):
        return -1.0
    linear = old + change
    predicted = float(old @ old - linear @ linear)
    actual = float((old - new) @ (old + new))
    return actual / predicted if predicted > 0.0 else -1.0


def _end(rows: _Rows, theta: Floats, residual: Floats, J: Floats | None, status: Status, steps: int) -> Fit:
    parameters = rows.problem.parameters
    covariance = np.full((len(parameters), len(parameters)), np.nan)
    at_bound: tuple[str, ...] = ()
    if J is not None:
        free = rows.free
        at = (theta[free] <= rows.lower) | (theta[free] >= rows.upper)
        at_bound = tuple(parameters[free[i]].name for i in np.flatnonzero(at))
        scaled = covariance_of(J)
        if scaled is not None:
            covariance[:] = 0.0
            covariance[np.ix_(free, free)] = scaled * np.outer(rows.scale, rows.scale)
        elif status is Status.CONVERGED:
            status = Status.RANK_DEFICIENT
        if at_bound and status is Status.CONVERGED:
            status = Status.AT_BOUND
    dof = len(residual) - len(rows.free)
    return Fit(theta, parameters, covariance, status, float(residual @ residual), dof, steps, at_bound)


def covariance_of(J: Floats) -> Floats | None:
    """(J'J)^-1 by QR, which does not square the condition; None when the columns are dependent."""
    if J.shape[1] == 0:
        return np.zeros((0, 0))
    if J.shape[0] < J.shape[1]:
        return None
    R = np.linalg.qr(J, mode="r")
    diagonal = np.abs(np.diag(R))
    if not np.all(np.isfinite(R)) or diagonal.min() < 1e-11 * diagonal.max():
        return None
    inverse = solve_triangular(R, np.eye(len(R)))
    return inverse @ inverse.T
