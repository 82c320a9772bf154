"""What all solvers share: the weighted rows of a problem, the linear steps and the covariance, and the record of a fit.

Rows are weighted data and priors of the free parameters, in columns of plausible size. With columns scaled so, a step
of 1 is a deviation to be expected, and one trust radius or damping serves lengths and angles alike. Bounds: a step is
clipped to them, and a parameter at its bound whose gradient pushes outwards is left out of the step (projected Newton,
Bertsekas, SIAM J. Control Optim. 20(2), 1982).
"""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack, solve_triangular

from calibrate.model.parameters import Parameter, plausible_sizes, priors, start_values
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
SINGULAR = 1e-11  # of the largest: below, columns are taken as dependent; rounding of whitened rows leaves about 1e-13
PANEL = 8  # columns that a QR takes at a time: measured best of 4, 8, 12, 16 and all
LEAST_RIDGE = 1e-15  # of the largest diagonal element: keeps an "undamped" step finite, changes no visible digit
Bools = NDArray[np.bool_]


def damped_step(normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Step of the damped normal equations, -(N + damping max(diag N) 1)^-1 g, for (free, free) and (free,).

    The ridge in scaled columns keeps combinations that the data cannot see where they are. ArithmeticError where N is
    not finite.
    """
    if len(gradient) == 0:
        return np.zeros(0)
    if not (np.all(np.isfinite(normal)) and np.all(np.isfinite(gradient))):
        raise ArithmeticError(f"normal equations of {len(gradient)} parameters are not finite; check weights")
    ridge = max(damping, LEAST_RIDGE) * float(np.max(np.diag(normal)))
    for _ in range(60):
        damped = np.array(normal, order="F")
        damped.ravel("K")[:: len(gradient) + 1] += ridge
        step, indefinite = _by_cholesky(damped, gradient)
        if not indefinite:
            return -step
        ridge *= 10.0  # rounding made it indefinite
    raise ArithmeticError(f"normal equations of {len(gradient)} parameters stay indefinite; check weights")


def _by_cholesky(matrix: Floats, right: Floats) -> tuple[Floats, bool]:
    """Solution x (n,) of matrix x = right, and whether the matrix, which is overwritten, is not positive definite.

    LAPACK itself: scipy's faces of it cost four times what the work does at 30 unknowns.
    """
    dposv = lapack.dposv  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    _, solution, info = dposv(matrix, right, lower=True, overwrite_a=True)
    return solution.reshape(len(right)), info != 0


def promised_gain(normal: Floats, gradient: Floats) -> float:
    """Decrease of the sum of squares that an (almost) undamped step promises."""
    return float(-gradient @ damped_step(normal, gradient, 0.0)) if len(gradient) else 0.0


def triangle_of(rows: Floats) -> Floats:
    """(min(row, column), column) R of the QR of rows (row, column): the same J'J in no more rows than need be.

    LAPACK itself, by panels and recursively: five times faster than numpy's for tall rows. Source: Elmroth, Gustavson,
    IBM J. Res. Dev. 44(4), 2000.
    """
    if 0 in rows.shape:
        return np.zeros((0, rows.shape[1]))
    geqrt = lapack.dgeqrt  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    raw = geqrt(min(PANEL, *rows.shape), np.array(rows, order="F"), overwrite_a=True)[0]
    return np.triu(raw[: rows.shape[1]])


def gauss_newton_step(slope: Floats, residual: Floats) -> Floats:
    """(free,) shortest h that minimises |J h + e|: what the data cannot see is left where it is.

    By QR of [J e], then singular values of the small triangle (Golub, Van Loan, Matrix Computations, 4th ed., 5.5.5).
    """
    if slope.shape[1] == 0:
        return np.zeros(0)
    triangle = triangle_of(np.column_stack([slope, residual]))
    n = slope.shape[1]
    shortest = np.linalg.lstsq(triangle[:, :n], -triangle[:, n], rcond=SINGULAR)[0]
    return np.asarray(shortest, dtype=np.float64)


def covariance_of(J: Floats) -> Floats | None:
    """(J'J)^-1 by QR, which does not square the condition; None when the columns are dependent."""
    if J.shape[1] == 0:
        return np.zeros((0, 0))
    if J.shape[0] < J.shape[1]:
        return None
    R = triangle_of(J)
    diagonal = np.abs(np.diag(R))
    if not np.all(np.isfinite(R)) or diagonal.min() <= SINGULAR * diagonal.max():
        return None
    inverse = solve_triangular(R, np.eye(len(R)))
    return inverse @ inverse.T


class Status(Enum):
    """How a fit ended; the value is the sentence for a person."""

    CONVERGED = "predicted gain is below tolerance"
    OUT_OF_STEPS = "step limit reached; improve the start, or raise kmax of [dog-leg] in the fit plan"
    STALLED = (
        "no step makes the residual smaller, although the slope promises it; check derivatives, the start, e1 and e2"
    )
    RANK_DEFICIENT = "data cannot fix some combinations of parameters; they are held and named"
    AT_BOUND = "a parameter is at its bound: the question is not answered by these data"
    NOT_FINITE = "residual became infinite or undefined; check joint signs, the order of reflection and the rig"


class Stop(Enum):
    """The rule that ended the iteration; the value is the sentence for a person."""

    GAIN = "a full step promises less than the tolerance"
    ROUNDING = "neither a step nor its promise is above the rounding error of the sum of squares"
    DAMPING = "damping reached its limit: the residual is at its rounding error"
    GRADIENT = "largest element of the gradient is at most e1"
    RESIDUAL = "2-norm of the residual is at most e3"
    RADIUS = "trust radius shrank to e2 of the parameters"
    STEP = "step is no longer than e2 of the parameters"
    STEPS = "all allowed steps (kmax of Dog-Leg) were made"
    LIKELIHOOD = "a further round of weights changes -2 log L by less than 0.1"
    ROUNDS = "all allowed rounds of weights were made"
    NOT_FINITE = "residual or derivative is not finite"


@dataclass(frozen=True)
class Fit:
    """Values at the end, with their covariance where the free columns are of full rank."""

    theta: Floats  # (param,)
    parameters: tuple[Parameter, ...]
    covariance: Floats  # (param, param), zero for held ones, nan where it does not exist
    status: Status
    chi2: float  # sum of squares of data and prior rows, whatever the loss
    dof: int  # data and prior rows less free parameters
    steps: int
    at_bound: tuple[str, ...] = ()
    stop: Stop = Stop.GAIN
    cost: float = float("nan")  # what was made small: chi2 for squares, sum of the loss otherwise
    weights: Floats | None = None  # (row,) of the data rows under a robust loss, 1 = fully trusted; None: all 1

    @property
    def chi2_per_dof(self) -> float:
        """Near 1 when the model and the stated noise agree; nan without redundancy."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")


@dataclass(frozen=True)
class WeightedRows:
    """LeastSquares with its priors as rows; parameters enter by their free ones only, in units of `scale`."""

    problem: LeastSquares
    free: NDArray[np.intp]  # columns of theta
    scale: Floats  # (free,) plausible sizes
    centre: Floats  # (prior,) where priors pull to
    prior: Floats  # (prior,) their sigmas
    with_prior: NDArray[np.intp]  # among the free ones
    lower: Floats  # (free,)
    upper: Floats
    root_weight: Floats | None = None  # (row,) on the data rows; None: all 1

    @classmethod
    def of(cls, problem: LeastSquares) -> "WeightedRows":
        parameters = problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        prior, centre = priors(parameters)[free], start_values(parameters)[free]
        with_prior = np.flatnonzero(np.isfinite(prior))
        return cls(
            problem,
            free,
            plausible_sizes(parameters)[free],
            centre[with_prior],
            prior[with_prior],
            with_prior,
            np.array([p.lower for p in parameters])[free],
            np.array([p.upper for p in parameters])[free],
        )

    def weighted(self, weights: Floats) -> "WeightedRows":
        """The same with weights (row,) on the squares of the data rows."""
        return replace(self, root_weight=np.sqrt(weights))

    def residual(self, theta: Floats) -> Floats:
        """(row + prior,) data rows, then prior rows."""
        data = self.problem.residual(theta)
        if self.root_weight is not None:
            data = self.root_weight * data
        return np.concatenate([data, (theta[self.free][self.with_prior] - self.centre) / self.prior])

    def jacobian(self, theta: Floats) -> Floats:
        """(row + prior, free) by the scaled free parameters."""
        data = self.problem.jacobian(theta)
        out = np.zeros((len(data) + len(self.with_prior), len(self.free)))
        rows, prior_rows = out[: len(data)], out[len(data) :]
        np.take(data, self.free, axis=1, out=rows, mode="clip")
        rows *= self.scale
        if self.root_weight is not None:
            rows *= self.root_weight[:, None]
        prior_rows[range(len(self.with_prior)), self.with_prior] = self.scale[self.with_prior] / self.prior
        return out

    def scaled(self, theta: Floats) -> Floats:
        """(free,) values in units of plausible size."""
        return theta[self.free] / self.scale

    def moved(self, theta: Floats, step: Floats) -> Floats:
        """Theta after a scaled step (free,), clipped to the bounds."""
        out = theta.copy()
        out[self.free] = np.clip(theta[self.free] + step * self.scale, self.lower, self.upper)
        return out

    def taken(self, theta: Floats, trial: Floats) -> Floats:
        """(free,) the scaled step between two theta."""
        return (trial - theta)[self.free] / self.scale

    def pressed(self, theta: Floats, gradient: Floats) -> Bools:
        """(free,) at a bound with descent pointing out of it."""
        value = theta[self.free]
        return ((value <= self.lower) & (gradient > 0.0)) | ((value >= self.upper) & (gradient < 0.0))

    def at_bound(self, theta: Floats) -> Bools:
        """(free,) at a bound, whatever the gradient."""
        value = theta[self.free]
        return (value <= self.lower) | (value >= self.upper)


@dataclass(frozen=True)
class Ended:
    """Where an algorithm came to rest; residual and slope are those of `WeightedRows` at `theta`."""

    theta: Floats
    residual: Floats
    slope: Floats | None  # None where the residual is not finite
    stop: Stop
    steps: int


def columns(slope: Floats, active: Bools) -> Floats:
    """(row, active) those columns; the same array where all are, so that J'J costs half (one buffer, one triangle)."""
    return slope if active.all() else slope[:, active]


def gain_ratio(old: Floats, new: Floats, change: Floats) -> float:
    """Actual over predicted decrease of the sum of squares for a linear change (row,); -1 where `new` is not finite."""
    if not np.all(np.isfinite(new)):
        return -1.0
    linear = old + change
    predicted = float((old - linear) @ (old + linear))
    actual = float((old - new) @ (old + new))
    return actual / predicted if predicted > 0.0 else -1.0
