"""Inner parameters of one candidate to their best value, before anything is refitted.

A grid step away from the truth turns rows into outliers and breeds followers.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.score import Removed
from calibrate.diagnose.visible import VISIBLE
from calibrate.effects.term import Inner, Term

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
    columns = bench.state.columns(term, inner)
    size = np.linalg.norm(columns, axis=0)
    unit = (columns / np.where(size > 0.0, size, 1.0)).T
    seen = bench.sight.complement(unit)
    gram, along = seen @ seen.T, seen @ bench.sight.residual
    if without is not None:
        back = unit @ without.span
        gram, along = gram + back @ back.T, along + back @ without.part
    w, V = np.linalg.eigh(gram)
    turned = np.where(w > VISIBLE, V.T @ along, 0.0)
    found = V @ (turned / np.maximum(w, VISIBLE))
    return found / np.where(size > 0.0, size, 1.0), float(np.sum(turned**2 / np.maximum(w, VISIBLE)))


def _explains(bench: Bench, term: Term, inner: Floats, j: int, without: Removed | None) -> Callable[[float], float]:
    def squares(value: float) -> float:
        trial = inner.copy()
        trial[j] = value
        return solved(bench, term, trial, without)[1]

    return squares


def telling_times(bench: Bench, term: Term, inner: Floats) -> Floats:
    """(time,) of the samples that can show when a step was: those that would feel it, had it always been there."""
    ends = np.where([spec.later for spec in term.inner], np.inf, -np.inf)
    always = np.where([spec.discrete for spec in term.inner], ends, inner)
    felt = np.any(term.basis(bench.state.drivers, always) != 0.0, axis=(1, 2))
    return np.unique(bench.state.drivers.t_s[felt])


def _best_of_one(squares: Callable[[float], float], spec: Inner, value: float, times: Floats) -> float:
    """Between the neighbours of a value on the grid; a step between two of the `times` that can show it."""
    grid = np.array([spec.lower, *spec.grid, spec.upper])
    below, above = grid[grid < value], grid[grid > value]
    low, high = (float(below.max()) if len(below) else value), (float(above.min()) if len(above) else value)
    if high <= low:
        return value
    if spec.discrete:
        return _best_of(squares, [value, *_between(times, low, high)])

    def left(x: float) -> float:
        return -squares(x)

    found = minimize_scalar(left, bounds=(low, high), method="bounded", options={"xatol": FINE * (high - low)})
    return _best_of(squares, [value, float(found.x)])


def _best_of(squares: Callable[[float], float], values: Sequence[float]) -> float:
    return max(values, key=squares)


def _between(times: Floats, low: float, high: float) -> list[float]:
    """Middles of neighbouring times from low to high."""
    middle = (times[1:] + times[:-1]) / 2.0
    return [float(x) for x in middle[(middle > low) & (middle < high)]]
