"""Robust losses by iterated reweighting, and the covariance that belongs to their estimate.

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
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.levenberg import least_gain
from calibrate.fit.solvers.linear import covariance_of, promised_gain
from calibrate.fit.solvers.loss import Loss
from calibrate.fit.solvers.result import Stop
from calibrate.fit.solvers.rows import Ended, Rows
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
Run = Callable[[Rows, Floats], Ended]

MAX_ROUNDS = 200  # of weights; each shrinks the way to go by the share of distrusted rows, usually 2 to 10 times
Widths = NDArray[np.intp]


def reweighted(rows: Rows, theta: Floats, loss: Loss, run: Run, tolerance: float) -> Ended:
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


def _settled(rows: Rows, theta: Floats, loss: Loss, tolerance: float) -> bool:
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


def robust_covariance(rows: Rows, theta: Floats, loss: Loss) -> Floats | None:
    """(free, free) in scaled columns: A^-1 B A^-1; None where it does not exist.

    An observation bends by its curvature in one direction and by its weight in the k - 1 across; the directions of
    noise being all alike, a value bends by the mean of these.
    """
    z = rows.problem.residual(theta)
    groups = Groups.of(rows.problem, len(z))
    length, k = groups.norms(z), groups.widths
    slope = rows.jacobian(theta)
    data, beliefs = slope[: len(z)], slope[len(z) :]
    weight = loss.weight(length, k)
    bend = groups.spread((loss.curvature(length, k) + (k - 1) * weight) / np.maximum(k, 1))
    level = float(np.mean(bend))
    if len(z) <= slope.shape[1] or level <= 0.0:
        return None
    correction = 1.0 + slope.shape[1] / len(z) * float(np.var(bend)) / level**2
    spread = correction**2 * float(np.sum((weight * length) ** 2)) / (len(z) - slope.shape[1])
    inverse = covariance_of(np.concatenate([np.sqrt(level) * data, beliefs]))
    if inverse is None:
        return None
    return inverse @ (spread * data.T @ data + beliefs.T @ beliefs) @ inverse


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
