"""Robust losses, and their fit by iteratively reweighted least squares.

A loss is what a whitened observation costs by its length, which gives the weight with which it then counts.
Sources: Huber, Robust Statistics, 1981, ch. 3-4; Holland, Welsch, Comm. Statist. A6(9), 1977 (tuning for 95 %
efficiency at the normal law: 1.345 and 2.385); Lange, Little, Taylor, JASA 84, 1989 (Student's t by reweighting).
A loss is scaled to be z^2 for small z, so that its sum compares with chi2. An observation of k values bends where as
many of good ones lie beyond as of single values beyond the width (the same quantile of chi-square, Maronna, Ann.
Statist. 4(1), 1976); Student's t is the multivariate one, weight (nu + k) / (nu + z^2).

Each round solves a weighted least-squares problem that touches the loss from above, so the cost never rises (Lange,
Hunter, Yang, J. Comput. Graph. Statist. 9(1), 2000). Covariance: Huber, Robust Statistics, 1981, eq. (7.6.3) with his
correction K, for rows whose scale is stated; prior rows stay squares, with their own variance of one. All values of an
observation share one weight, by its length.

Which residual values are of one observation: a bad shot is bad in all its coordinates, so it is weighted as one.
What counts for a loss is then the Mahalanobis norm of an observation's whitened values. Sources: Maronna, Ann. Statist.
4(1), 1976 (weights of the norm); Lange, Little, Taylor, JASA 84, 1989 (the multivariate t).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

from calibrate.fit.solvers.least_squares import Ended, Stop, WeightedRows, covariance_of, promised_gain
from calibrate.fit.solvers.trust_region import least_gain
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
Widths = NDArray[np.intp]
SINGLE = np.ones(1, dtype=np.intp)
Run = Callable[[WeightedRows, Floats], Ended]
MAX_ROUNDS = 200  # of weights; each shrinks the way to go by the share of distrusted rows, usually 2 to 10 times


class LossKind(Enum):
    """The law of the residuals that a loss answers to."""

    SQUARE = "normal law"
    HUBER = "normal in the middle, with heavy tails that still pull a little"
    CAUCHY = "Cauchy-like: a far row is let go"
    STUDENT_T = "Student's t"


@dataclass(frozen=True)
class Loss:
    """A kind with its width: sigmas where it bends (Huber, Cauchy) or degrees of freedom nu (Student's t)."""

    kind: LossKind
    width: float

    SQUARE: ClassVar["Loss"]
    HUBER: ClassVar["Loss"]
    CAUCHY: ClassVar["Loss"]
    STUDENT_T: ClassVar["Loss"]

    def __post_init__(self) -> None:
        if not self.width > 0.0:
            raise ValueError(f"{self.kind.name} loss: width {self.width} is not positive")

    @classmethod
    def student_t(cls, nu: float) -> "Loss":
        """Student's t with nu degrees of freedom; small nu forgives more."""
        return cls(LossKind.STUDENT_T, nu)

    @property
    def convex(self) -> bool:
        """One minimum for a linear problem; the others need a start near their best one."""
        return self.kind in (LossKind.SQUARE, LossKind.HUBER)

    def bend(self, k: Widths) -> Floats:
        """(obs,) length at which the loss of an observation of k (obs,) values bends; the width itself for Student's t.

        The far quantile is taken from its complement, which keeps digits for wide losses.
        """
        if self.kind in (LossKind.SQUARE, LossKind.STUDENT_T):
            return np.full(len(k), self.width)
        widths, which = np.unique(k, return_inverse=True)
        beyond = chdtrc(1, self.width**2)
        return np.array([self.width if w == 1 else np.sqrt(chdtri(w, beyond)) for w in widths.tolist()])[which]

    def cost(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) what observations of length z (obs,) over k values (obs,), or all one, cost."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return np.where(np.abs(z) <= c, square, 2.0 * c * np.abs(z) - c**2)
        if self.kind is LossKind.CAUCHY:
            return c**2 * np.log1p(square / c**2)
        return (c + k) * np.log1p(square / c) if self.kind is LossKind.STUDENT_T else square

    def weight(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) cost'(z) / (2 z): the weight with which squares have the same slope."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return c / np.maximum(np.abs(z), c)
        if self.kind is LossKind.CAUCHY:
            return 1.0 / (1.0 + square / c**2)
        return (c + k) / (c + square) if self.kind is LossKind.STUDENT_T else np.ones_like(z)

    def curvature(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) cost''(z) / 2 along the observation's own direction; negative where the loss bends back."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return (np.abs(z) <= c).astype(float)
        if self.kind is LossKind.CAUCHY:
            return (1.0 - square / c**2) / (1.0 + square / c**2) ** 2
        return (c + k) * (c - square) / (c + square) ** 2 if self.kind is LossKind.STUDENT_T else np.ones_like(z)


Loss.SQUARE = Loss(LossKind.SQUARE, 1.0)


Loss.HUBER = Loss(LossKind.HUBER, 1.345)


Loss.CAUCHY = Loss(LossKind.CAUCHY, 2.385)


Loss.STUDENT_T = Loss.student_t(4.0)  # Lange et al.: 4 served well where nu was not estimated


def reweighted(rows: WeightedRows, theta: Floats, loss: Loss, run: Run, tolerance: float) -> Ended:
    """Minimum of the loss from theta (param,) by rounds of `run`; losses that bend back start at Huber's answer.

    Residual and slope of the answer are those of the last weights.
    """
    if not loss.convex:
        theta = reweighted(rows, theta, Loss.HUBER, run, tolerance).theta
    steps = 0
    ended = Ended(theta, rows.residual(theta), None, Stop.NOT_FINITE, 0)
    for _ in range(MAX_ROUNDS):
        weighted = rows.weighted(row_weights(rows.problem, rows.problem.residual(theta), loss))
        ended = run(weighted, theta)
        steps += ended.steps
        if ended.slope is None or ended.stop is Stop.STEPS:
            return replace(ended, steps=steps)
        theta = ended.theta
        if _settled(rows, theta, loss, tolerance):
            return replace(ended, steps=steps)
    return replace(ended, steps=steps, stop=Stop.ROUNDS)


def _settled(rows: WeightedRows, theta: Floats, loss: Loss, tolerance: float) -> bool:
    """Under the weights of its own residuals, a full step from here promises less than the tolerance."""
    weighted = rows.weighted(row_weights(rows.problem, rows.problem.residual(theta), loss))
    residual, slope = weighted.residual(theta), weighted.jacobian(theta)
    gradient = slope.T @ residual
    active = ~rows.pressed(theta, gradient)
    promised = promised_gain(slope[:, active].T @ slope[:, active], gradient[active])
    return promised < least_gain(tolerance, residual)


def row_weights(problem: LeastSquares, residual: Floats, loss: Loss) -> Floats:
    """(row,) weights of the values of a whitened residual (row,)."""
    groups = Groups.of(problem, len(residual))
    return groups.spread(loss.weight(groups.norms(residual), groups.widths))


def total_cost(problem: LeastSquares, residual: Floats, loss: Loss) -> float:
    """Sum of the loss over all observations of a whitened residual (row,)."""
    groups = Groups.of(problem, len(residual))
    return float(np.sum(loss.cost(groups.norms(residual), groups.widths)))


def robust_covariance(rows: WeightedRows, theta: Floats, loss: Loss) -> Floats | None:
    """(free, free) in scaled columns: A^-1 B A^-1; None where it does not exist.

    An observation bends by its curvature in one direction and by its weight in the k - 1 across; the directions of
    noise being all alike, a value bends by the mean of these.
    """
    z = rows.problem.residual(theta)
    groups = Groups.of(rows.problem, len(z))
    length, k = groups.norms(z), groups.widths
    slope = rows.jacobian(theta)
    data, prior_rows = slope[: len(z)], slope[len(z) :]
    weight = loss.weight(length, k)
    bend = groups.spread((loss.curvature(length, k) + (k - 1) * weight) / np.maximum(k, 1))
    level = float(np.mean(bend))
    if len(z) <= slope.shape[1] or level <= 0.0:
        return None
    correction = 1.0 + slope.shape[1] / len(z) * float(np.var(bend)) / level**2
    spread = correction**2 * float(np.sum((weight * length) ** 2)) / (len(z) - slope.shape[1])
    inverse = covariance_of(np.concatenate([np.sqrt(level) * data, prior_rows]))
    if inverse is None:
        return None
    return inverse @ (spread * data.T @ data + prior_rows.T @ prior_rows) @ inverse


@runtime_checkable
class Grouped(Protocol):
    """A problem that states how many residual values each of its observations has."""

    @property
    def row_widths(self) -> Widths:
        """(observation,) values of each, in the order of the residual."""
        ...


@dataclass(frozen=True)
class Groups:
    """Observations of `widths` (observation,) values, one after the other."""

    widths: Widths

    @classmethod
    def of(cls, problem: LeastSquares, rows: int) -> "Groups":
        """As the problem states, else each of its `rows` values for itself."""
        return cls(problem.row_widths if isinstance(problem, Grouped) else np.ones(rows, dtype=np.intp))

    @cached_property
    def _first(self) -> Widths:
        return np.concatenate([[0], np.cumsum(self.widths)[:-1]]).astype(np.intp)

    def norms(self, residual: Floats) -> Floats:
        """(observation,) length of each observation's whitened residual (row,)."""
        filled = self.widths > 0
        out = np.zeros(len(self.widths))
        if filled.any():
            out[filled] = np.sqrt(np.add.reduceat(residual**2, self._first[filled]))
        return out

    def spread(self, values: Floats) -> Floats:
        """(row,) from values (observation,)."""
        return np.repeat(values, self.widths)
