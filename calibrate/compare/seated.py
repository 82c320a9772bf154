"""Rows in which the probe is seated, in a cone or at an end of a bar: there the joints are the reading.

What two sessions of one motion can be asked is where each has the tip, by one model: of a cone, whose place
is unknown, about the mean of its rows; of a bar, the length.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, SEAT
from calibrate.model.predict import Predictor

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

LENGTH = ("bar_m",)
NONE = -1


def is_seated(samples: Samples) -> Bools:
    """(row,)"""
    seated = np.zeros(len(samples), dtype=bool)
    for name in (SEAT, BAR):
        if name in samples:
            seated |= samples.integers(name, NONE) != NONE
    return seated


def lengths_of(samples: Samples) -> Ints:
    """(bar, 2) rows of end a and end b: consecutive rows with a bar, of one bar, both ends. Odd ones are left out."""
    if BAR not in samples or BAR_END not in samples:
        return np.zeros((0, 2), dtype=np.intp)
    bar, end = samples.integers(BAR, NONE), samples.columns[BAR_END]
    rows = np.flatnonzero(bar != NONE)
    out: list[tuple[int, int]] = []
    taken = NONE
    for i, j in pairwise(rows.tolist()):
        if i == taken or bar[i] != bar[j] or {str(end[i]), str(end[j])} != {"a", "b"}:
            continue
        out.append((i, j) if str(end[i]) == "a" else (j, i))
        taken = j
    return np.array(out, dtype=np.intp).reshape(-1, 2)


def tip_differences(model: Predictor, measured: Samples, simulated: Samples) -> Floats | None:
    """(row, 3) in the base, about the mean of each seat; NaN outside of cones. None without two rows in one."""
    if SEAT not in measured or SEAT not in simulated:
        return None
    seat = measured.integers(SEAT, NONE)
    apart = model.tip_m(measured.joints()) - model.tip_m(simulated.joints())
    out = np.full(apart.shape, np.nan)
    for k in np.unique(seat[seat != NONE]):
        rows = np.flatnonzero(seat == k)
        if len(rows) > 1:
            out[rows] = apart[rows] - apart[rows].mean(axis=0)
    return out if np.any(np.isfinite(out)) else None


def bar_differences(model: Predictor, measured: Samples, simulated: Samples) -> Floats | None:
    """(row, 1) of the length, in the row of end b. None without a bar."""
    pairs = lengths_of(measured)
    if not len(pairs) or BAR not in simulated:
        return None
    said = [model.tip_m(one.joints()) for one in (measured, simulated)]
    lengths = [np.linalg.norm(tips[pairs[:, 1]] - tips[pairs[:, 0]], axis=1) for tips in said]
    out = np.full((len(measured), 1), np.nan)
    out[pairs[:, 1], 0] = lengths[0] - lengths[1]
    return out
