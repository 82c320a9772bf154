"""Least squares along what the data see: one rank analysis for geometry and effects together.

Link n and joint n's zero do to a target what its own place on the flange does; joint 1's zero and link 1's offset what
the device's place does; a bracket that gives way alike in all directions is a device that stands lower. Along such
combinations no reading changes, but full steps along them leave the range in which the model is linear, and a solver
creeps. They stay where they were; so does an effect along what geometry and the effects accepted before it can make
of the readings, which is its price in parameters.

Source: truncated singular values, Golub, Van Loan, Matrix Computations, 4th ed. 2013, section 5.5; in units of the
deviation to be expected of each value, so that a singular value of 1 is as much as everybody knows.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose import limits
from calibrate.diagnose.state.effect_problem import EffectProblem
from calibrate.fit.solvers import Fit, Loss, covariance_of, solve, triangle_of
from calibrate.model.parameters import (
    Parameter,
    plausible_sizes,
    priors,
    start_values,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

DEPENDENT = 1e-9  # of a unit column: what is left below is rounding


@dataclass(frozen=True, eq=False)
class Directions:
    """Moves of the values that the data see."""

    moves: Floats  # (value, move) each of the size to be expected: damping holds back what is hardly seen first
    own: Ints  # (move,) the value that a move is, of those with bounds; -1 elsewhere


def in_sight(problem: EffectProblem, theta: Floats) -> Directions:
    """Of a problem at values theta (value,). Terms in the order in which they were accepted.

    The rows of the data enter as their triangle, which has the same products of columns in far fewer rows.
    """
    parameters, owner = problem.parameters, problem.owner
    assumed = priors(parameters)
    unit = _units(problem)
    free = np.array([p.free for p in parameters])
    bounded = free & np.array([bool(np.isfinite(p.lower) or np.isfinite(p.upper)) for p in parameters])
    rows = np.concatenate([triangle_of(problem.jacobian(theta) * unit), np.diag(unit / assumed)])
    out = [_of_geometry(rows, np.flatnonzero(free & ~bounded & (owner < 0)), len(parameters))]
    basis = np.linalg.qr(rows[:, free & (owner < 0)])[0]
    for term in range(int(owner.max(initial=-1)) + 1):
        mine = np.flatnonzero(free & (owner == term) & ~bounded)
        found, span = _of_term(rows, mine, basis, len(parameters))
        out.append(found)
        basis = _with(basis, np.concatenate([span, rows[:, bounded & (owner == term)]], axis=1))
    own = [np.full(sum(part.shape[1] for part in out), -1, dtype=np.intp), np.flatnonzero(bounded)]
    out.append(np.eye(len(parameters))[:, bounded])
    moves = np.concatenate(out, axis=1) * np.where(bounded, 1.0, unit)[:, None]
    return Directions(moves, np.concatenate(own))


def _units(problem: EffectProblem) -> Floats:
    """(value,) sizes to be expected; of terms what is assumed about them, which is loose."""
    assumed, plausible = priors(problem.parameters), plausible_sizes(problem.parameters)
    return np.where(problem.owner < 0, np.minimum(assumed, plausible), plausible)


def _of_geometry(rows: Floats, mine: Ints, values: int) -> Floats:
    """(value, move); prior rows stand below those of the data."""
    data = rows[: len(rows) - values, mine]
    _, s, Vt = np.linalg.svd(data, full_matrices=False)
    kept = s > limits.UNSEEN
    out = np.zeros((values, int(kept.sum())))
    out[mine] = Vt[kept].T
    return out


def _with(basis: Floats, columns: Floats) -> Floats:
    """An orthonormal basis (row, k) and what further columns (row, m) add to it.

    Taken out twice: once leaves the rounding of what is taken out. Source: Giraud, Langou, Rozloznik, The loss of
    orthogonality in the Gram-Schmidt orthogonalization process, Comput. Math. Appl. 50(7), 2005.
    """
    size = np.linalg.norm(columns, axis=0)
    left = columns[:, size > 0.0] / size[size > 0.0]
    for _ in range(2):
        left = left - basis @ (basis.T @ left)
    Q, R = np.linalg.qr(left)
    return np.concatenate([basis, Q[:, np.abs(np.diag(R)) > DEPENDENT]], axis=1)


def _of_term(rows: Floats, mine: Ints, basis: Floats, values: int) -> tuple[Floats, Floats]:
    """(value, move) of a term, and what these do to the rows beyond an orthonormal basis."""
    data = rows[:, mine].copy()
    data[len(rows) - values :] = 0.0  # its own assumption is loose, and no part of what is seen
    size = np.linalg.norm(data, axis=0)
    column = data / np.where(size > 0.0, size, 1.0)
    seen = column - basis @ (basis.T @ column)
    w, V = np.linalg.eigh(seen.T @ seen)
    kept = w > limits.VISIBLE
    out = np.zeros((values, int(kept.sum())))
    out[mine] = V[:, kept] * (size.max(initial=0.0) / np.where(size > 0.0, size, 1.0))[:, None]
    return out, seen @ V[:, kept]


@dataclass(frozen=True, eq=False)
class _Along:
    """LeastSquares of how far to go along each direction; assumptions are rows like the others."""

    problem: EffectProblem
    directions: Directions
    start: Floats  # (value,)
    with_prior: Ints
    centre: Floats
    sigma: Floats

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        known = self.problem.parameters
        return tuple(
            Parameter(f"move{k}", "1", 1.0)
            if i < 0
            else Parameter(f"move{k}", "1", known[i].plausible, float(self.start[i]), np.inf, *_bounds(known[i]))
            for k, i in enumerate(self.directions.own.tolist())
        )

    def values(self, along: Floats) -> Floats:
        """(value,) of the problem."""
        own = self.directions.own >= 0
        moved = self.start + self.directions.moves[:, ~own] @ along[~own]
        moved[self.directions.own[own]] = along[own]
        return moved

    def residual(self, theta: Floats) -> Floats:
        """(row + prior,)"""
        values = self.values(theta)
        away = (values[self.with_prior] - self.centre) / self.sigma
        return np.concatenate([self.problem.residual(values), away])

    def jacobian(self, theta: Floats) -> Floats:
        """(row + prior, move)"""
        data = self.problem.jacobian(self.values(theta)) @ self.directions.moves
        return np.concatenate([data, self.directions.moves[self.with_prior] / self.sigma[:, None]])


def _bounds(parameter: Parameter) -> tuple[float, float]:
    return parameter.lower, parameter.upper


def solve_in_sight(
    problem: EffectProblem,
    start: Floats,
    directions: Directions,
    *,
    damping: float,
    max_steps: int = 100,
    tolerance: float = 1e-8,
    loss: Loss = Loss.SQUARE,
) -> Fit:
    """Least squares from `start` (value,) along the directions; values and covariance of the whole problem."""
    parameters = problem.parameters
    free = np.flatnonzero([p.free for p in parameters])
    sigma, centre = priors(parameters), start_values(parameters)
    with_prior = free[np.isfinite(sigma[free])]
    along = _Along(problem, directions, start, with_prior, centre[with_prior], sigma[with_prior])
    found = solve(along, damping=damping, max_steps=max_steps, tolerance=tolerance, loss=loss, covariance=False)
    theta = along.values(found.theta)
    return Fit(
        theta,
        parameters,
        _covariance(problem, theta, free, with_prior, sigma),
        found.status,
        found.chi2,
        found.dof - len(free) + len(directions.own),
        found.steps,
        stop=found.stop,
    )


def _covariance(problem: EffectProblem, theta: Floats, free: Ints, with_prior: Ints, sigma: Floats) -> Floats:
    """(value, value) of all free values, along what is not seen by what is assumed; nan where it does not exist."""
    n, unit = len(theta), plausible_sizes(problem.parameters)[free]
    prior_rows = np.zeros((len(with_prior), len(free)))
    prior_rows[range(len(with_prior)), np.searchsorted(free, with_prior)] = unit[np.searchsorted(free, with_prior)]
    prior_rows /= sigma[with_prior][:, None]
    scaled = covariance_of(np.concatenate([problem.jacobian(theta)[:, free] * unit, prior_rows]))
    if scaled is None:
        return np.full((n, n), np.nan)
    out = np.zeros((n, n))
    out[np.ix_(free, free)] = scaled * np.outer(unit, unit)
    return out
