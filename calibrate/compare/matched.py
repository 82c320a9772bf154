"""Which row of one table is which of another: rows of one plan, missing on either side.

What a session states of each sample, its station, beam order, number in the plan and repeat, decides where both state
it. Tables without it that have the same stations and repeats in the same order are rows of one plan as they stand. Only
where rows are missing do joint angles decide, to within what a servo may have moved the arm. Angles that differ by a
constant in all rows, zeros of degrees, make no difference.

Longest common subsequence (Wagner and Fischer, J. ACM 21, 1974) with a small reward for being near; a row of the inner
loop is one vector operation, since the best so far along a row is a running maximum.

Rows in which the probe is seated, in a cone or at an end of a bar: there the joints are the reading.

What two sessions of one motion can be asked is where each has the tip, by one model: of a cone, whose place
is unknown, about the mean of its rows; of a bar, the length.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, PLANE, SEAT, per_joint
from calibrate.errors import DataError
from calibrate.model.predict import Predictor

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Bools = NDArray[np.bool_]

LENGTH = ("bar_m",)
NONE = -1


def is_seated(samples: Samples) -> Bools:
    """(row,)"""
    seated = np.zeros(len(samples), dtype=bool)
    for name in (SEAT, PLANE, BAR):
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


SAME_RAD = 0.02  # of every joint, at least: a servo that centres goes to a slightly other place
FAR_RAD = 0.15  # at most: no servo moves the arm so far
NEAREST = 0.4  # of the distance between neighbouring poses of the plan
SPREAD = 0.1  # rad: joints of one plan, but for a constant of each joint, keep to within so much in most rows
MOST = 0.9
MOST_ROWS = 5_000  # of a table whose rows are found by joint angles: two tables of so many take half a gigabyte
# A constant of a joint beyond any servo, that hardly varies: another zero of degrees.
CONSTANT_RAD, VARIES = 0.05, 0.2
WHAT = ("placement", "first_psd", SEAT, PLANE, BAR, BAR_END, "target")  # where both state it, it must be the same
ORDERED = (*WHAT, "repeat")

Key = tuple[object, ...]  # of a sample: its place in the plan


@dataclass(frozen=True)
class Matched:
    """Rows of both tables that belong together, in order; the others are missing on the other side."""

    measured: Ints
    simulated: Ints
    only_measured: Ints
    only_simulated: Ints


def match(measured: Samples, simulated: Samples, plans: tuple[Sequence[Key], Sequence[Key]] | None = None) -> Matched:
    """`plans`: of each row of both tables its place in the plan, where the recordings state it.

    DataError for arms of different joints, and where no row of one is a row of the other.
    """
    if measured.n_joints != simulated.n_joints:
        raise DataError(
            f"measured: {measured.n_joints} joints, simulated: {simulated.n_joints} joints; "
            "give recordings of the same arm"
        )
    for name, samples in (("measured", measured), ("simulated", simulated)):
        if len(samples) == 0:
            raise DataError(f"{name}: no sample; give a recording that holds some")
    by_plan = None if plans is None else _by_plan(*plans)
    if by_plan is None and _same_rows(measured, simulated):
        by_plan = np.arange(len(measured)), np.arange(len(measured))
    if by_plan is None:
        by_plan = _longest(_nearness(measured, simulated))
    rows, columns = _whole_bars(measured, *by_plan)
    if not len(rows):
        raise DataError(
            "no sample of the one recording is a sample of the other, neither by plan and order nor by joint angles; "
            "compare recordings of the same motion"
        )
    others = [np.setdiff1d(np.arange(n), used) for n, used in ((len(measured), rows), (len(simulated), columns))]
    return Matched(rows, columns, *others)


def zeros_between(measured: Samples, simulated: Samples) -> Floats:
    """(joint,) rad by which measured angles are larger in all matched rows, far beyond any servo; else 0.

    Whole turns are none.
    """
    apart = measured.joints() - simulated.joints()
    middle = np.median(apart, axis=0)
    spread = np.median(np.abs(apart - middle), axis=0)
    return np.where((np.abs(middle) > CONSTANT_RAD) & (spread < VARIES * np.abs(middle)), middle, 0.0)


def _by_plan(measured: Sequence[Key], simulated: Sequence[Key]) -> tuple[Ints, Ints] | None:
    """Rows of one place in the plan, one by one where a sample was taken again. None where the plans are others."""
    there = {key: row for row, key in enumerate(_numbered(simulated))}
    pairs = [(row, there[key]) for row, key in enumerate(_numbered(measured)) if key in there]
    if len(pairs) < MOST / 2.0 * min(len(measured), len(simulated)):
        return None
    rows = np.array(pairs, dtype=np.intp)
    return rows[:, 0], rows[:, 1]


def _numbered(keys: Sequence[Key]) -> list[Key]:
    """With how often the key came before."""
    seen: Counter[Key] = Counter()
    out: list[Key] = []
    for key in keys:
        out.append((key, seen[key]))
        seen[key] += 1
    return out


def _same_rows(measured: Samples, simulated: Samples) -> bool:
    """Whether both hold the same stations, beam orders and repeats in one order, and joints that keep to each other."""
    if len(measured) != len(simulated):
        return False
    for name in ORDERED:
        if name in measured and name in simulated:
            one, two = _labels(measured, name), _labels(simulated, name)
            if not np.array_equal(one, two, equal_nan=True):
                return False
    apart = measured.joints() - simulated.joints()
    near = np.all(np.abs(apart - np.median(apart, axis=0)) < SPREAD, axis=1)
    return bool(np.mean(near) >= MOST)


def _nearness(measured: Samples, simulated: Samples) -> Floats:
    """(row, row) 1 to 2 where they may be one pose, 0 elsewhere. DataError for tables that are too large for this."""
    for name, samples in (("measured", measured), ("simulated", simulated)):
        if len(samples) > MOST_ROWS:
            raise DataError(
                f"{name}: {len(samples)} rows, and the recordings are not the same motion row by row; rows are found "
                f"by joint angles among at most {MOST_ROWS}: compare a part of the recordings"
            )
    one, two = _poses(measured, simulated), _poses(simulated, measured)
    same_rad = _reach(two)
    apart = np.array([_off(pose, two) for pose in one])
    may = apart < same_rad
    for name in WHAT:
        if name in measured and name in simulated:
            mine, theirs = _labels(measured, name)[:, None], _labels(simulated, name)[None]
            may &= (mine == theirs) | np.isnan(mine) | np.isnan(theirs)
    np.subtract(2.0, np.divide(apart, same_rad, out=apart), out=apart)
    apart[~may] = 0.0
    return apart


def _off(pose: Floats, poses: Floats) -> Floats:
    """(row,) the largest difference of a joint."""
    return np.abs(poses - pose).max(axis=1)


def _reach(poses: Floats) -> float:
    """Rad of every joint within which a pose is the same: less than half the way to the poses around it."""
    apart = (_off(pose, poses) for pose in poses)
    # repeats are the same pose
    nearest = np.array([np.min(one, where=one > SAME_RAD, initial=np.inf) for one in apart])
    nearest = nearest[np.isfinite(nearest)]
    if not len(nearest):
        return SAME_RAD
    return float(np.clip(NEAREST * np.quantile(nearest, 1.0 - MOST), SAME_RAD, FAR_RAD))


def _labels(samples: Samples, name: str) -> Floats:
    """(row,) as numbers, NaN where nothing is stated."""
    if name != BAR_END:
        return samples.column(name)
    end = samples.columns[name]
    return np.where(end == "a", 0.0, np.where(end == "b", 1.0, np.nan))


def _whole_bars(measured: Samples, rows: Ints, columns: Ints) -> tuple[Ints, Ints]:
    """Without ends of a bar whose other end has no partner: half a length means nothing."""
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
