"""Which row of one table is which of another: the same motion, in the same order, rows missing on either side.

Longest common subsequence (Wagner and Fischer, J. ACM 21, 1974) with a small reward for being near; a row of the inner
loop is one vector operation, since the best so far along a row is a running maximum.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, SEAT, per_joint
from calibrate.diagnose.compare.seated import NONE, lengths_of
from calibrate.errors import DataError

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

# Of every joint: a servo that centres goes to a slightly other place; poses of a plan lie farther apart.
SAME_RAD = 0.02
WHAT = ("placement", "first_psd", SEAT, BAR, BAR_END)  # where both say it, it must be the same


@dataclass(frozen=True)
class Matched:
    """Rows of both tables that belong together, in order; the others are missing on the other side."""

    measured: Ints
    simulated: Ints
    only_measured: Ints
    only_simulated: Ints


def match(measured: Samples, simulated: Samples) -> Matched:
    """DataError for arms of different joints, and where no row of one is a row of the other."""
    if measured.n_joints != simulated.n_joints:
        raise DataError(
            f"measured: {measured.n_joints} joints, simulated: {simulated.n_joints} joints; "
            "give recordings of the same arm"
        )
    for name, samples in (("measured", measured), ("simulated", simulated)):
        if len(samples) == 0:
            raise DataError(f"{name}: no sample; give a recording that holds some")
    near = _nearness(measured, simulated)
    rows, columns = _whole_bars(measured, *_longest(near))
    if not len(rows):
        raise DataError(
            f"no sample of the one recording was taken at a pose of the other (within {SAME_RAD} rad of each joint); "
            "compare recordings of the same motion"
        )
    others = [np.setdiff1d(np.arange(n), used) for n, used in ((len(measured), rows), (len(simulated), columns))]
    return Matched(rows, columns, *others)


def _nearness(measured: Samples, simulated: Samples) -> Floats:
    """(row, row) 1 to 2 where they may be one pose, 0 elsewhere."""
    apart = np.abs(_poses(measured, simulated)[:, None] - _poses(simulated, measured)[None]).max(axis=2)
    may = apart < SAME_RAD
    for name in WHAT:
        if name in measured and name in simulated:
            one, two = _labels(measured, name)[:, None], _labels(simulated, name)[None]
            may &= (one == two) | np.isnan(one) | np.isnan(two)
    return np.where(may, 2.0 - apart / SAME_RAD, 0.0)


def _labels(samples: Samples, name: str) -> Floats:
    """(row,) as numbers, NaN where nothing is said."""
    if name != BAR_END:
        return samples.column(name)
    end = samples.columns[name]
    return np.where(end == "a", 0.0, np.where(end == "b", 1.0, np.nan))


def _whole_bars(measured: Samples, rows: Ints, columns: Ints) -> tuple[Ints, Ints]:
    """Without ends of a bar whose other end has no partner: half a length says nothing."""
    if BAR not in measured:
        return rows, columns
    alone = measured.integers(BAR, NONE)[rows] != NONE
    alone[lengths_of(measured.take(rows)).ravel()] = False
    return rows[~alone], columns[~alone]


def _poses(samples: Samples, other: Samples) -> Floats:
    """As commanded where both know it: that is the same motion, whatever became of it."""
    commanded = samples.commanded()
    names = per_joint("cmd", "_rad", samples.n_joints)
    both = commanded is not None and all(name in other for name in names)
    if commanded is None or not both or not np.all(np.isfinite(commanded)):
        return samples.joints()
    theirs = other.commanded()
    return commanded if theirs is not None and np.all(np.isfinite(theirs)) else samples.joints()


def _longest(near: Floats) -> tuple[Ints, Ints]:
    n, m = near.shape
    best = np.zeros((n + 1, m + 1))
    for i in range(n):
        taken = np.where(near[i] > 0.0, best[i, :-1] + near[i], 0.0)
        best[i + 1, 1:] = np.maximum.accumulate(np.maximum(best[i, 1:], taken))
    rows, columns = [], []
    i, j = n, m
    while i and j:
        if best[i, j] == best[i - 1, j]:
            i -= 1
        elif best[i, j] == best[i, j - 1]:
            j -= 1
        else:
            i, j = i - 1, j - 1
            rows.append(i)
            columns.append(j)
    return np.array(rows[::-1], dtype=np.intp), np.array(columns[::-1], dtype=np.intp)
