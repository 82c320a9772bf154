"""A first guess of offset and rate between two clocks, good to some samples: correlation of speeds, window by window.

Generalised cross-correlation by FFT (Knapp and Carter, IEEE ASSP 24, 1976) of what all channels do together: the norm
of their speeds, which knows nothing of zeros and signs.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.track import Track

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Ticks:
    """reference clock = other clock + offset_s + rate_error (other clock - at_s)."""

    offset_s: float
    rate_error: float = 0.0
    at_s: float = 0.0


def coarse(reference: Track, other: Track, start: Ticks | None = None) -> Ticks | None:
    """None where too little moves, or the motions are not alike. With `start` only REACH_S about it is searched."""
    if len(reference.time_s) < 2 * limits.GRID_SMOOTH or len(other.time_s) < 2 * limits.GRID_SMOOTH:
        return None
    rate_error, at_s = (start.rate_error, start.at_s) if start is not None else (0.0, 0.0)
    shifted = other.time_s + rate_error * (other.time_s - at_s)
    ref_s, ref = _speeds(reference.time_s, reference.values)
    own_s, own = _speeds(shifted, other.values)
    if not (_range(ref) > 0.0 and _range(own) > 0.0):
        return None
    offset_s = start.offset_s if start is not None else _best(ref_s, ref, own_s, own)[0]
    apart = [
        _window(ref_s, ref, own_s, own, begin, offset_s)
        for begin in np.arange(own_s[0], own_s[-1], limits.COARSE_WINDOW_S)
    ]
    seen = np.array([one for one in apart if one is not None])
    if not len(seen):
        return None
    if len(seen) < 3:
        return Ticks(float(np.median(seen[:, 1])), rate_error, at_s)
    level, more = straight_line(seen[:, 0], seen[:, 1])
    if abs(more) > limits.WORST_RATE:
        return Ticks(offset_s, rate_error, at_s)  # too few windows to outvote a wild one
    total = (1.0 + rate_error) * (1.0 + more) - 1.0  # seen[:, 0] is on the clock that the start's rate made
    return Ticks(level + more * at_s, total, at_s)


def straight_line(x: Floats, y: Floats) -> tuple[float, float]:
    """Level and slope, the medians of all slopes between two points (Theil 1950, Sen 1968): a quarter may be wild."""
    apart = x[:, None] - x[None]
    pairs = apart > 0.0
    slope = float(np.median((y[:, None] - y[None])[pairs] / apart[pairs])) if np.any(pairs) else 0.0
    return float(np.median(y - slope * x)), slope


def _speeds(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Norm of the channels' speeds on an even grid, each channel by its own size; NaN where nothing was read."""
    grid = np.arange(time_s[0], time_s[-1], limits.GRID_S)
    size = np.std(values, axis=0)
    even = np.stack([np.interp(grid, time_s, channel) for channel in values.T], axis=1) / np.where(size > 0, size, 1.0)
    kernel = np.ones(limits.GRID_SMOOTH) / limits.GRID_SMOOTH
    smooth = np.stack([np.convolve(channel, kernel, mode="same") for channel in even.T], axis=1)
    speed = np.linalg.norm(np.gradient(smooth, limits.GRID_S, axis=0), axis=1)
    speed[: 2 * limits.GRID_SMOOTH] = speed[-2 * limits.GRID_SMOOTH :] = np.nan
    nearest = np.clip(np.searchsorted(time_s, grid), 1, len(time_s) - 1)
    hole = (time_s[nearest] - time_s[nearest - 1]) > max(5.0 * limits.GRID_S, 5.0 * float(np.median(np.diff(time_s))))
    speed[np.convolve(hole, np.ones(2 * limits.GRID_SMOOTH + 1), mode="same") > 0] = np.nan
    return grid, speed


def _best(ref_s: Floats, ref: Floats, own_s: Floats, own: Floats) -> tuple[float, float]:
    """Offset with the highest correlation (Pearson's, of what overlaps and was seen), and that correlation."""
    seen, there = np.isfinite(own).astype(float), np.isfinite(ref).astype(float)
    o, r = np.nan_to_num(own), np.nan_to_num(ref)
    n = _slid(there, seen)
    enough = n > 0.5 * seen.sum()
    n = np.maximum(n, 1.0)
    sum_r, sum_o = _slid(r, seen), _slid(there, o)
    both = _slid(r, o) - sum_r * sum_o / n
    spread = (_slid(r**2, seen) - sum_r**2 / n) * (_slid(there, o**2) - sum_o**2 / n)
    floor = 1e-9 * float(np.max(spread, initial=0.0))
    score = np.where(enough & (spread > floor), both / np.sqrt(np.maximum(spread, max(floor, 1e-300))), -1.0)
    at = int(np.argmax(score))
    lag = at + 1 - len(own)
    return float(ref_s[0] - own_s[0] + lag * limits.GRID_S), float(score[at])


def _slid(one: Floats, two: Floats) -> Floats:
    """Products at every lag, the last of `two` on the first of `one` first."""
    count = len(one) + len(two) - 1
    size = next_fast_len(count, real=True)
    return np.fft.irfft(np.fft.rfft(one, size) * np.fft.rfft(two[::-1], size), size)[:count]


def _range(values: Floats) -> float:
    """Largest less smallest of what was read; 0 where nothing was."""
    read = values[np.isfinite(values)]
    return float(np.ptp(read)) if len(read) else 0.0


def _window(
    ref_s: Floats, ref: Floats, own_s: Floats, own: Floats, begin_s: float, offset_s: float
) -> tuple[float, float] | None:
    """Middle of the window on the other clock, and its offset; None where it stands, or differs."""
    mine = (own_s >= begin_s) & (own_s < begin_s + limits.COARSE_WINDOW_S)
    theirs = (ref_s >= begin_s + offset_s - limits.COARSE_REACH_S) & (
        ref_s < begin_s + limits.COARSE_WINDOW_S + offset_s + limits.COARSE_REACH_S
    )
    if mine.sum() < 4 * limits.GRID_SMOOTH or theirs.sum() < mine.sum() or _range(own[mine]) < 0.05 * _range(own):
        return None
    found, alike = _best(ref_s[theirs], ref[theirs], own_s[mine], own[mine])
    return (float(own_s[mine].mean()), found) if alike > limits.WINDOW_CORRELATION else None
