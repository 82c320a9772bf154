"""Noise of every instrument at a fit: how large, how far each observation is trusted, and what whitens it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.augmented import Augmented
from calibrate.diagnose.scatter import Scatter, scatter_of
from calibrate.fit import Fit
from calibrate.identification.session import believed_sigma
from calibrate.parameters import priors
from calibrate.problem import whitener_of

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_FITTED = 0.2  # of the rows that are left over, at least, when noise is judged


def scatters_of(problem: Augmented, fit: Fit) -> tuple[Scatter, ...]:
    """Noise of every instrument at the values of a fit."""
    at, larger = problem.around(fit.theta), freedom(problem, fit.covariance)
    out: list[Scatter] = []
    for i, (m, rows) in enumerate(zip(problem.session.measured, problem.rows, strict=True)):
        residual = m.problem.observed[rows] - at.expected[i][rows]
        found = scatter_of(residual, problem.by_joint(at, i)[rows], believed_sigma(m)[rows])
        out.append(replace(found, covariance=found.covariance * larger))
    return tuple(out)


def freedom(problem: Augmented, covariance: Floats) -> float:
    """Rows over rows less what was fitted to them: residuals of a fit are smaller than the noise."""
    rows = sum(
        len(r) * m.problem.observed.shape[1] for m, r in zip(problem.session.measured, problem.rows, strict=True)
    )
    free = np.array([p.free for p in problem.parameters])
    believed = np.diag(covariance)[free] / priors(problem.parameters)[free] ** 2
    fitted = float(np.sum(1.0 - np.clip(np.nan_to_num(believed), 0.0, 1.0)))
    fitted -= 0.0 if problem.assumed is None else problem.assumed.holds(covariance)
    return rows / max(rows - fitted, MOST_FITTED * rows)


def whiteners_of(scatters: tuple[Scatter, ...]) -> tuple[Floats, ...]:
    """Of each instrument (row, k, k), robust weights included."""
    return tuple(whitener_of(s.covariance) * np.sqrt(s.weights)[:, None, None] for s in scatters)


def trusted(scatters: tuple[Scatter, ...]) -> tuple[Scatter, ...]:
    """The same noise, every observation with its full weight."""
    return tuple(replace(s, weights=np.ones(len(s.weights))) for s in scatters)


def covariance_at(scatter: Scatter, known: Ints, rows: Ints) -> Floats:
    """(row, k, k) noise at rows: as found where the fit has seen them, else the middle one of those it has."""
    if len(scatter.covariance) == 0:  # nobody knows: as good as no weight
        return np.broadcast_to(np.eye(scatter.covariance.shape[-1]), (len(rows), *scatter.covariance.shape[1:]))
    # A whole one of them: medians of single entries together need be no covariance.
    middle = np.argsort(np.trace(scatter.covariance, axis1=1, axis2=2))[len(scatter.covariance) // 2]
    out = np.broadcast_to(scatter.covariance[middle], (len(rows), *scatter.covariance.shape[1:])).copy()
    seen = np.isin(rows, known)
    out[seen] = scatter.covariance[np.searchsorted(known, rows[seen])]
    return out
