"""Samples taken before the arm had settled: the mean of a sample's window against the rest of the same stand."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from calibrate.diagnose.streams.finding import Outcome
from calibrate.diagnose.streams.stands import Stand
from calibrate.diagnose.streams.track import Track, white_noise

Floats = NDArray[np.float64]

ALARM = 1e-3  # over all samples
MATTERS = 1.0  # sigmas of one reading: below, nobody would see it
LATER_S = 0.05  # of the stand, at least, from which the settled reading is taken
BLOCK = 5  # samples averaged before the noise of a mean is judged: it may hang together over some


@dataclass(frozen=True)
class Window:
    """When a sample was taken, on the clock of the stream."""

    from_s: float
    to_s: float


@dataclass(frozen=True)
class Unsettled:
    """Of one sample: still to come (channel,) with sigma, time constant of the settling where it can be determined."""

    outcome: Outcome
    missing: Floats | None = None
    sigma: Floats | None = None
    tau_s: float | None = None
    left_share: float | None = None  # of what moved in the stream after the stop
    p: float = 1.0


def unsettled(track: Track, windows: Sequence[Window], stands: Sequence[Stand]) -> tuple[Unsettled, ...]:
    """One answer a window. NOT_DETERMINABLE: it lies in no stand, or the arm went on at once."""
    track = track.read()  # rising: what follows cuts, it does not search
    return tuple(_of_window(track, window, _stand_of(window, stands), len(windows)) for window in windows)


def _stand_of(window: Window, stands: Sequence[Stand]) -> Stand | None:
    middle = 0.5 * (window.from_s + window.to_s)
    return next((s for s in stands if s.from_s <= middle <= s.to_s), None)


def _of_window(track: Track, window: Window, stand: Stand | None, tests: int) -> Unsettled:
    if stand is None or stand.to_s - window.to_s < LATER_S:
        return Unsettled(Outcome.NOT_DETERMINABLE)
    own = _cut(track, max(window.from_s, stand.from_s), window.to_s).values
    late_from_s = max(window.to_s, 0.5 * (window.to_s + stand.to_s))
    late = _cut(track, late_from_s, stand.to_s).values
    if len(own) < 2 or len(late) < 2 * BLOCK:
        return Unsettled(Outcome.NOT_DETERMINABLE)
    missing = late.mean(axis=0) - own.mean(axis=0)
    white = np.maximum(white_noise(late), _slow(late))
    white = np.where(np.isfinite(white) & (white > 0.0), white, np.finfo(float).tiny)
    sigma = white * np.sqrt(1.0 / len(own) + 1.0 / len(late))
    p = min(1.0, tests * len(missing) * float(2.0 * norm.sf(np.max(np.abs(missing) / sigma))))
    if p >= ALARM or np.all(np.abs(missing) < MATTERS * white):
        return Unsettled(Outcome.ABSENT, missing, sigma, p=p)
    settling = _cut(track, stand.from_s, stand.to_s)
    return Unsettled(Outcome.FOUND, missing, sigma, *_decay(settling, window, white), p=p)


def _cut(track: Track, from_s: float, to_s: float) -> Track:
    """Ends included, of a track in rising time."""
    t = track.time_s
    return track.take(slice(int(np.searchsorted(t, from_s)), int(np.searchsorted(t, to_s, side="right"))))


def _slow(values: Floats) -> Floats:
    """(channel,) sigma of a sample that the scatter of means of BLOCK samples stands for."""
    whole = len(values) // BLOCK * BLOCK
    means = values[:whole].reshape(-1, BLOCK, values.shape[1]).mean(axis=1)
    if len(means) < 4:
        return np.zeros(values.shape[1])
    return np.sqrt(BLOCK * np.mean(np.diff(means, axis=0) ** 2, axis=0) / 2.0)


def _decay(stand: Track, window: Window, noise: Floats) -> tuple[float | None, float | None]:
    """Time constant of one exponential over the stand, and what share of it the window still missed."""
    t = stand.time_s - stand.time_s[0]
    y = stand.values / noise
    best: tuple[float, float, float] | None = None
    squares = float(np.sum((y - y.mean(axis=0)) ** 2))
    for tau in np.geomspace(max(2.0 * stand.period_s, 1e-3), t[-1], 60):
        U, _ = np.linalg.qr(np.stack([np.ones_like(t), np.exp(-t / tau)], axis=1))
        left = float(np.sum((y - U @ (U.T @ y)) ** 2))
        if best is None or left < best[0]:
            begin, end = window.from_s - stand.time_s[0], window.to_s - stand.time_s[0]
            share = tau * (np.exp(-begin / tau) - np.exp(-end / tau)) / max(end - begin, 1e-9)
            best = left, float(tau), float(share)
    if best is None or best[1] >= 0.5 * t[-1] or squares - best[0] < 30.0:
        return None, None  # no exponential: it wanders, or rings
    return best[1], best[2]
