"""Whether a slow term holds where the arm came back to a pose: geometry cannot change there, but time has gone by.

A drift that geometry has half absorbed looks like one; between two visits of one pose geometry says the same, so what
changed there is the drift alone, or there was none (mismatch catalogue, false alarms).
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.null import is_slow

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

TELLING = 5.0  # sigmas that the term would show between visits: with less, they say nothing
HALF = 0.5  # of the term has to be there
SIGMAS = 3.0


def fading(bench: Bench) -> list[int]:
    """Accepted slow terms of which less than half is seen between visits of one pose."""
    slow = [i for i, a in enumerate(bench.state.accepted) if is_slow(a.term)]
    if not slow:
        return []
    trusting = Bench(bench.state.trusting())  # robust weights take out just those rows that speak against the term
    visits = _visits(trusting)
    return [i for i in slow if _fades(trusting, i, visits)]


def _fades(bench: Bench, i: int, visits: Ints) -> bool:
    amount = bench.contribution(bench.state.accepted[i])
    moved = _between(amount, visits)
    shown = float(np.linalg.norm(moved))
    if shown < TELLING:
        return False
    seen = float(moved @ _between(amount + bench.state.rows.residual, visits)) / shown**2
    return seen + SIGMAS / shown < HALF


def _visits(bench: Bench) -> Ints:
    """(row,) a number for each component of each repeated pose; -1 elsewhere."""
    rows, repeat = bench.state.rows, bench.state.drivers.repeat
    out = np.full(len(rows.residual), -1)
    if repeat is None:
        return out
    at = np.flatnonzero(rows.data)
    first = np.flatnonzero(np.diff(rows.group[at], prepend=-1))
    component = np.arange(len(at)) - np.repeat(first, np.diff(first, append=len(at)))
    label = np.stack([rows.instrument[at], repeat[rows.sample[at]], component])
    again = label[1] >= 0
    out[at[again]] = np.unique(label[:, again], axis=1, return_inverse=True)[1].ravel()
    return out


def _between(values: Floats, visits: Ints) -> Floats:
    """Of values (row,) what differs from the mean over the visits of the same pose."""
    met, v = visits[visits >= 0], values[visits >= 0]
    return v - (np.bincount(met, v) / np.maximum(np.bincount(met), 1))[met]
