"""Inner parameters of one candidate to their best value, before anything is refitted.

A grid step away from the truth turns rows into outliers and breeds followers.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from calibrate.diagnose import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.score import Removed
from calibrate.model.effects.term import Accepted, Inner, Term

Floats = NDArray[np.float64]

SWEEPS = 3  # over several inner parameters in turn
FINE = 1e-3  # of the bracket


def refined(bench: Bench, term: Term, inner: Floats, without: Removed | None = None) -> Accepted:
    """The term with inner values that explain most, and the coefficients that belong to them."""
    best = inner.copy()
    for _ in range(SWEEPS if len(term.inner) > 1 else min(len(term.inner), 1)):
        before = best.copy()
        for j, spec in enumerate(term.inner):
            times = telling_times(bench, term, best) if spec.discrete else np.zeros(0)
            best[j] = _best_of_one(_explains(bench, term, best, j, without), spec, best[j], times)
        if np.array_equal(best, before):
            break
    return Accepted(term, solved(bench, term, best, without)[0], best)


def solved(bench: Bench, term: Term, inner: Floats, without: Removed | None = None) -> tuple[Floats, float]:
    """(coefficient,) with everything else refitted, and what they explain of the residual's square."""
    found, squares = _solved(bench, term, [inner], without)
    return found[0], float(squares[0])


def _solved(bench: Bench, term: Term, inner: Sequence[Floats], without: Removed | None) -> tuple[Floats, Floats]:
    """(value, coefficient) and (value,) of several inner values at once."""
    columns = bench.state.columns_at(term, inner)
    size = np.linalg.norm(columns, axis=2)
    size = np.where(size > 0.0, size, 1.0)
    unit = columns / size[:, :, None]
    flat = unit.reshape(-1, unit.shape[2])

    def through(basis: Floats) -> Floats:
        return (flat @ basis).reshape(*unit.shape[:2], -1)

    absorbed, along = through(bench.sight.basis), through(bench.sight.residual)
    gram = unit @ np.swapaxes(unit, 1, 2) - absorbed @ np.swapaxes(absorbed, 1, 2)
    if without is not None:
        back = through(without.span)
        gram, along = gram + back @ np.swapaxes(back, 1, 2), along + back @ without.part[:, None]
    w, V = np.linalg.eigh(gram)
    turned = np.where(w > limits.VISIBLE, (np.swapaxes(V, 1, 2) @ along)[..., 0], 0.0)
    found = (V @ (turned / np.maximum(w, limits.VISIBLE))[..., None])[..., 0]
    return found / size, np.sum(turned**2 / np.maximum(w, limits.VISIBLE), axis=1)


def _explains(
    bench: Bench, term: Term, inner: Floats, j: int, without: Removed | None
) -> Callable[[Sequence[float]], Floats]:
    """Of values (value,) of one inner parameter what they explain."""

    def squares(values: Sequence[float]) -> Floats:
        trials = np.tile(inner, (len(values), 1))
        trials[:, j] = values
        return _solved(bench, term, list(trials), without)[1]

    return squares


def telling_times(bench: Bench, term: Term, inner: Floats) -> Floats:
    """(time,) of the samples that can show when a step was: those of the fit that would feel it, had it always been
    there.
    """
    ends = np.where([spec.later for spec in term.inner], np.inf, -np.inf)
    always = np.where([spec.discrete for spec in term.inner], ends, inner)
    felt = np.any(term.basis(bench.state.drivers, always) != 0.0, axis=(1, 2))
    seen = np.unique(bench.state.rows.sample[bench.state.rows.data])
    return np.unique(bench.state.drivers.t_s[seen[felt[seen]]])


def _best_of_one(squares: Callable[[Sequence[float]], Floats], spec: Inner, value: float, times: Floats) -> float:
    """Between the neighbours of a value on the grid; a step between two of the `times` that can show it."""
    grid = np.array([spec.lower, *spec.grid, spec.upper])
    below, above = grid[grid < value], grid[grid > value]
    low, high = (float(below.max()) if len(below) else value), (float(above.min()) if len(above) else value)
    if high <= low:
        return value
    if spec.discrete:
        return _best_of(squares, [value, *_between(times, low, high)])

    def left(x: float) -> float:
        return -float(squares([x])[0])

    found = minimize_scalar(left, bounds=(low, high), method="bounded", options={"xatol": FINE * (high - low)})
    return _best_of(squares, [value, float(found.x)])


def _best_of(squares: Callable[[Sequence[float]], Floats], values: Sequence[float]) -> float:
    return values[int(np.argmax(squares(values)))]


def _between(times: Floats, low: float, high: float) -> list[float]:
    """Middles of neighbouring times from low to high."""
    middle = (times[1:] + times[:-1]) / 2.0
    return [float(x) for x in middle[(middle > low) & (middle < high)]]
