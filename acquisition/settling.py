"""When the readings have settled: two neighbouring short windows of the spots agree within their noise.

Judged by the PSD box's own sample times, so the rule is the same whether the world runs in real time or faster.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SAMPLES_FOR_A_MEAN = 3


@dataclass(frozen=True)
class SettleRule:
    """Windows of `window_s`; agreement within `sigmas` of their noise, but never finer than `floor_m`."""

    window_s: float = 0.02
    sigmas: float = 4.0
    floor_m: float = (
        1e-6  # below the reading noise of a window at 1 kHz (2 um / sqrt(20) = 0.45 um, two windows, 1.5 sigma)
    )
    limit_s: float = 1.0  # of device time; then the sample is taken and marked as not settled


@dataclass(frozen=True)
class Stretch:
    """The device time to average over."""

    from_s: float
    to_s: float
    settled: bool


def stretch_to_average(device_s: Floats, spots_m: Floats, dwell_s: float, rule: SettleRule) -> Stretch | None:
    """`dwell_s` of the samples so far, from where they have settled; the last ones when they do not; None: wait on.

    At least one window, and SAMPLES_FOR_A_MEAN of a slow or halting box: a single sample has no sigma.
    """
    dwell_s = max(dwell_s, rule.window_s)
    last_s = float(device_s[-1])
    start_s = settled_from(device_s, spots_m, rule)
    if start_s is not None:
        later_s = device_s[device_s >= start_s]
        if len(later_s) < SAMPLES_FOR_A_MEAN or last_s - start_s < dwell_s:
            return None
        return Stretch(start_s, max(start_s + dwell_s, float(later_s[SAMPLES_FOR_A_MEAN - 1])), settled=True)
    if last_s - float(device_s[0]) > rule.limit_s + dwell_s and len(device_s) >= SAMPLES_FOR_A_MEAN:
        return Stretch(min(last_s - dwell_s, float(device_s[-SAMPLES_FOR_A_MEAN])), last_s, settled=False)
    return None


def settled_from(device_s: Floats, spots_m: Floats, rule: SettleRule) -> float | None:
    """Start (device time, s) of the first pair of windows that agree; None while there is none.

    `spots_m` (sample, 4), NaN where dark: a dark coordinate agrees with a dark one only.
    """
    period_s = float(np.median(np.diff(device_s))) if device_s.size > 1 else 0.0
    size = max(4, round(rule.window_s / period_s)) if period_s > 0.0 else 0
    if size == 0 or device_s.size < 2 * size:
        return None
    for start in range(0, device_s.size - 2 * size + 1, size):
        if _agree(spots_m[start : start + size], spots_m[start + size : start + 2 * size], rule):
            return float(device_s[start])
    return None


def _agree(one: Floats, two: Floats, rule: SettleRule) -> bool:
    dark_one, dark_two = np.isnan(one).any(axis=0), np.isnan(two).any(axis=0)
    if np.any(dark_one != dark_two):
        return False
    lit = ~dark_one
    if not np.any(lit):
        return True
    # From neighbouring samples, so that a slow ringing does not count as noise and hide itself (von Neumann 1941).
    jumps = np.concatenate([np.diff(one[:, lit], axis=0), np.diff(two[:, lit], axis=0)])
    noise_m = np.sqrt(jumps.var(axis=0) / 2.0) * np.sqrt(2.0 / len(one))
    apart_m = np.abs(one[:, lit].mean(axis=0) - two[:, lit].mean(axis=0))
    return bool(np.all(apart_m <= np.maximum(rule.sigmas * noise_m, rule.floor_m)))
