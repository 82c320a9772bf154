"""The period at which a device measured, from times that were stamped late, in bursts, or by a clock that was set.

    stamp = start + period * number + steps of the clock + delay,   delay >= 0

A stamp of arrival is never early, so only the least delayed row of each window counts (as in `device_clock`, after
Moon, Skelly and Towsley, IEEE INFOCOM 1999). A line with steps is fitted through these rows by least squares. A step is
sought between neighbouring windows and has to last: a host that was busy for a while is late, and then punctual again.
Whether sampling is regular at all is judged by the ratio of von Neumann (Annals of Mathematical Statistics 12, 1941),
of successive differences to the scatter, 2 where the rows keep a period, near 0 where each interval starts at the last.
"""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.samples import Floats

Ints = NDArray[np.int64]

CLOSE = 0.2  # of the mean interval; a regular stream has hardly a row so soon after the one before
WINDOW_ROWS = 16  # at least, and
WINDOW_BURSTS = 6  # bursts at least, so that one of them ends soon after a sample
FEWEST_WINDOWS, MOST_WINDOWS = 10, 200
LASTS = 3  # windows on either side of a step
STEP_SIGMAS = 8.0  # of a difference between windows
STEP_S = 5e-3  # below, a step is none that a clock makes: NTP slews what is small
MOST_STEPS = 20
REGULAR_RATIO = 1.0  # of von Neumann: half of what independent delays give
REGULAR_SHARE = 0.25  # of a period: a clock that wanders by less still shows which sample is which
SIGMA_OF_MEDIAN = 1.4826


class SamplingStatus(enum.Enum):
    """How the estimate ended."""

    REGULAR = "regular"
    IRREGULAR = "the device does not measure at a constant interval"
    TOO_SHORT = "too few samples, or too few bursts, to separate a period from delays"
    UNORDERED = "the times or the sequence numbers do not rise"


@dataclass(frozen=True)
class ClockStep:
    """The clock of the stamps jumped by `size_s` before `row`; `skipped` sequence numbers are missing there."""

    row: int
    size_s: float
    sigma_s: float
    skipped: int


@dataclass(frozen=True, eq=False)
class Sampling:
    """Numbers are None unless REGULAR. `scatter_s`: of the least delayed row of a window, 1 sigma."""

    status: SamplingStatus
    period_s: float | None = None
    sigma_s: float | None = None
    start_s: float | None = None  # of the first row, by the clock before its first step
    scatter_s: float = 0.0
    steps: tuple[ClockStep, ...] = ()


def sampling_of(time_s: Floats, sequence: Ints) -> Sampling:
    """(row,) s and (row,) number of the sample, or of the row."""
    number = (sequence - sequence[:1]).astype(float)
    if np.any(np.diff(number) <= 0.0) or not np.all(np.isfinite(time_s)):
        return Sampling(SamplingStatus.UNORDERED)
    edges = _windows(time_s)
    if edges.size <= FEWEST_WINDOWS:
        return Sampling(SamplingStatus.TOO_SHORT)
    begin, counts = edges[:-1], np.diff(edges)
    means = (np.add.reduceat(x[: edges[-1]], begin) / counts for x in (time_s - time_s[0], number))
    period_s = float(np.median(np.divide(*map(np.diff, means))))
    late_s, steps = time_s, list[int]()
    solution, covariance, left_s = np.zeros(2), np.eye(2), time_s
    for _ in range(4):  # a better period chooses better rows
        late_s = time_s - time_s[0] - period_s * number
        rows = np.array([a + int(np.argmin(late_s[a:b])) for a, b in zip(begin, edges[1:], strict=True)])
        steps = _steps(number[rows], late_s[rows])
        solution, covariance, left_s = _line(number[rows], late_s[rows], steps)
        period_s += float(solution[1])
    scatter_s = float(np.sqrt(np.mean(left_s**2)))
    ratio = float(np.mean(np.diff(left_s) ** 2)) / max(scatter_s**2, 1e-24)
    if (
        not period_s > 0.0
        or len(steps) >= MOST_STEPS
        or (ratio < REGULAR_RATIO and scatter_s > REGULAR_SHARE * period_s)
    ):
        return Sampling(SamplingStatus.IRREGULAR)
    sigma = np.sqrt(np.diag(covariance) * max(1.0, 2.0 / max(ratio, 1e-3)))  # neighbours that wander count less
    found = tuple(
        _step(late_s, sequence, (int(edges[w - 1]), int(edges[min(w + 1, edges.size - 1)])), (size_s, sigma_s))
        for w, size_s, sigma_s in zip(steps, solution[2:].tolist(), sigma[2:].tolist(), strict=True)
    )
    start_s = float(time_s[0] + solution[0])
    return Sampling(SamplingStatus.REGULAR, period_s, float(sigma[1]), start_s, scatter_s, found)


def closeness(time_s: Floats, sequence: Ints) -> tuple[float, NDArray[np.bool_]]:
    """Mean interval in s, and of each row after the first whether it came far too soon after the one before."""
    between_s = np.diff(time_s)
    usual = np.sort(between_s[np.diff(sequence) == 1])
    ends = max(2, usual.size // 1000)  # a clock that was set, or slept
    interval_s = float(np.mean(usual[ends:-ends])) if usual.size > 2 * ends else 0.0
    return interval_s, between_s < CLOSE * interval_s


def _windows(time_s: Floats) -> Ints:
    """Bounds of windows of equal numbers of rows."""
    _, close = closeness(time_s, np.arange(time_s.size))
    bursts = max(int(np.count_nonzero(~close)), 1)
    rows = max(WINDOW_ROWS, WINDOW_BURSTS * time_s.size // bursts, time_s.size // MOST_WINDOWS)
    return np.linspace(0, time_s.size, time_s.size // rows + 1).astype(np.int64)


def _steps(number: Floats, late_s: Floats) -> list[int]:
    """Windows before which the level changes for good, the first of each."""
    change_s, ahead = np.diff(late_s), np.diff(number)
    change_s = change_s - float(np.median(change_s / ahead)) * ahead
    sigma_s = SIGMA_OF_MEDIAN * float(np.median(np.abs(change_s)))
    limit_s = max(STEP_S, STEP_SIGMAS * sigma_s)
    level_s = np.concatenate(([0.0], np.cumsum(change_s)))
    found: list[int] = []
    for at in np.argsort(-np.abs(change_s)):
        w = int(at) + 1
        if abs(change_s[at]) < limit_s or len(found) >= MOST_STEPS:
            break
        if any(abs(w - other) < LASTS for other in found) or not LASTS <= w <= late_s.size - LASTS:
            continue
        before, after = np.median(level_s[w - LASTS : w]), np.median(level_s[w : w + LASTS])
        if abs(after - before) > 0.5 * abs(change_s[at]):
            found.append(w)
    return sorted(found)


def _line(number: Floats, late_s: Floats, steps: list[int]) -> tuple[Floats, Floats, Floats]:
    """Start, slope and sizes of the steps; their covariance; what is left, (window,) s."""
    window = np.arange(number.size)
    whole = ~np.isin(window, [w - side for w in steps for side in (0, 1)])  # a part of a window may have no prompt row
    window, number, late_s = window[whole], number[whole], late_s[whole]
    scale = max(float(number[-1]), 1.0)
    after = [(window >= w).astype(float) for w in steps]
    design = np.stack([np.ones(number.size), number / scale, *after], axis=1)
    solution = np.linalg.lstsq(design, late_s, rcond=None)[0]
    left_s = late_s - design @ solution
    units = np.array([1.0, scale, *np.ones(len(steps))])
    variance = float(left_s @ left_s) / max(number.size - design.shape[1], 1)
    covariance = variance * np.linalg.pinv(design.T @ design) / np.outer(units, units)
    return solution / units, covariance, left_s


def _step(late_s: Floats, sequence: Ints, span: tuple[int, int], size: tuple[float, float]) -> ClockStep:
    """Its row, among those of the windows on both sides. No row is early, which shows where a level begins or ends."""
    first, end = span
    part = late_s[first:end]
    low_s = float(part.min()) + 0.5 * abs(size[0])
    low = np.flatnonzero(part < low_s)
    row = first + int(low[0] if size[0] < 0.0 else low[-1] + 1)
    row = min(max(row, 1), late_s.size - 1)
    return ClockStep(row, size[0], size[1], int(sequence[row] - sequence[row - 1]) - 1)
