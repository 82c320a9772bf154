"""Sizes of an accepted term with honest sigmas: what the readings scatter, and what stated masses may be off by."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import telling_times
from calibrate.diagnose.search.noise_law import curvature_of
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.loads import possible_rigs
from calibrate.model.effects.term import Accepted, Form, Size, Term

Floats = NDArray[np.float64]

INNER_STEP = 1e-3  # of the range of an inner parameter, for its difference quotient
WEIGHT = ("gravity_torque", "overturning_moment", "payload")  # drivers that follow from masses


def sizes_of(bench: Bench, i: int) -> dict[str, Size]:
    """Of accepted term i, everything else refitted along."""
    a = bench.state.accepted[i]
    slopes = [bench.state.columns(a.term, a.inner)]
    smooth = [j for j, spec in enumerate(a.term.inner) if not spec.discrete]
    slopes += [_by_inner(bench, a, j)[:, None] for j in smooth]
    span = bench.gone[i].span
    alone = span @ (span.T @ np.concatenate(slopes, axis=1))
    covariance = sandwich(bench, alone) + _by_masses(bench, a, span, alone)
    m = len(a.coefficients)
    inner_sigma = np.array([_between_samples(telling_times(bench, a.term, a.inner), t) for t in a.inner])
    inner_sigma[smooth] = np.sqrt(np.maximum(np.diag(covariance)[m:], 0.0))
    return dict(a.term.sizes(a.coefficients, covariance[:m, :m], a.inner, inner_sigma))


def _between_samples(t: Floats, time_s: float) -> float:
    """Sigma of a moment of which only the times t before and after it are known: equally likely in between."""
    after = int(np.searchsorted(t, time_s))
    return float(t[after] - t[after - 1]) / 12.0**0.5 if 0 < after < len(t) else 0.0


def sandwich(bench: Bench, columns: Floats) -> Floats:
    """(m, m) covariance of values with columns (row, m) that nothing else can stand in for, by what the residuals
    really scatter; an infinite variance where the data do not determine the value.

    Weights follow the residuals, so least squares under them is too sure of itself. Source: Huber, The behavior of
    maximum likelihood estimates under nonstandard conditions, Proc. 5th Berkeley Symp. 1, 1967 (the sandwich), whole
    observations together, residuals corrected for leverage.
    """
    rows, data = bench.state.rows, bench.state.rows.data
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    unit = columns / size
    leverage = np.minimum(np.sum(bench.sight.basis**2, axis=1), limits.MOST_LEVERAGE)
    met = unit * (bench.sight.residual / np.sqrt(1.0 - leverage))[:, None]
    _, group = np.unique(rows.group[data], return_inverse=True)
    each = np.zeros((int(group.max()) + 1, columns.shape[1]))
    np.add.at(each, group, met[data])
    w, V = np.linalg.eigh(unit.T @ unit * curvature_of(rows))
    determined = w > limits.DETERMINED * max(float(w.max(initial=0.0)), 1e-300)
    inverse = (V[:, determined] / w[determined]) @ V[:, determined].T
    found = inverse @ (each.T @ each + unit[~data].T @ unit[~data]) @ inverse
    covariance = np.asarray(found / np.outer(size, size), dtype=np.float64)
    undetermined = np.any(np.abs(V[:, ~determined]) > limits.PART_OF_UNDETERMINED, axis=1)
    covariance[undetermined, undetermined] = np.inf
    return covariance


def _by_masses(bench: Bench, a: Accepted, span: Floats, alone: Floats) -> Floats:
    """(m, m) covariance that comes of masses: each, off by a sigma, would have moved the values by so much."""
    rigs = possible_rigs(bench.state.drivers) if a.term.depends_on[0].startswith(WEIGHT) else ()
    if not rigs:
        return np.zeros((alone.shape[1], alone.shape[1]))

    def moved(drivers: Drivers, inner: Floats) -> Floats:
        plain = a.term.basis(drivers, inner) @ a.coefficients
        each = [a.term.basis(replace(drivers, rig=rig), inner) @ a.coefficients - plain for rig in rigs]
        return np.stack(each, axis=2)

    felt = bench.state.columns(_like(a.term, moved, len(rigs)), a.inner)
    size = np.maximum(np.linalg.norm(alone, axis=0), 1e-300)
    by = np.linalg.lstsq(alone / size, span @ (span.T @ felt), rcond=1e-8)[0] / size[:, None]
    return by @ by.T


def _like(term: Term, function: Callable[[Drivers, Floats], Floats], columns: int) -> Term:
    """Other columns at the same port."""
    names = tuple(f"doubt{k}" for k in range(columns))
    return Form(
        term.port, term.depends_on, term.shape, term.physics, function=function, names=names, limit=np.inf, sentence=""
    )


def _by_inner(bench: Bench, a: Accepted, j: int) -> Floats:
    spec = a.term.inner[j]
    step = np.zeros(len(a.inner))
    step[j] = INNER_STEP * (spec.upper - spec.lower)
    up, down = bench.state.columns(a.term, a.inner + step), bench.state.columns(a.term, a.inner - step)
    return (up - down) @ a.coefficients / (2.0 * step[j])
