"""Samples taken before the arm had settled: the mean of a sample's window against the rest of the same stand.

When the arm was asked to stand: stretches in which the set-point does not change.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.track import Outcome, Track, white_noise

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Stand:
    """`moved` (channel,): change of the set-point in the motion before; zero for the first."""

    from_s: float
    to_s: float
    moved: Floats


def stands_of(setpoint: Track) -> tuple[Stand, ...]:
    """Stands of at least SHORTEST_STAND_S: of the set-point, or of joints as read; both are flat at a stand."""
    setpoint = setpoint.read()
    if len(setpoint.time_s) < 3:
        return ()
    span = max(1, round(0.03 / max(setpoint.period_s, 1e-4)))
    change = np.abs(setpoint.values[span:] - setpoint.values[:-span]).max(axis=1, initial=0.0)
    taken_s = setpoint.time_s[span:] - setpoint.time_s[:-span]
    moving = np.zeros(len(setpoint.time_s), dtype=bool)
    fast = change > limits.MOVING_RAD_S * np.maximum(taken_s, 1e-9)
    moving[:-span] |= fast  # from its first sample to its last: a change within the span belongs to the motion
    moving[span:] |= fast
    edges = np.flatnonzero(np.diff(np.concatenate([[1], moving.astype(int), [1]])))
    out: list[Stand] = []
    before = None
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        at = setpoint.values[begin:end].mean(axis=0)
        # a stand is widened by the span that moving was widened by, but not over a change
        begin, end = _widened(setpoint, int(begin), int(end), span, at)
        from_s, to_s = float(setpoint.time_s[begin]), float(setpoint.time_s[end - 1])
        if to_s - from_s >= limits.SHORTEST_STAND_S:
            out.append(Stand(from_s, to_s, np.zeros_like(at) if before is None else at - before))
            before = at
    return tuple(out)


def _widened(setpoint: Track, begin: int, end: int, span: int, at: Floats) -> tuple[int, int]:
    lowest, highest = max(0, begin - span), min(len(setpoint.time_s), end + span)
    near = np.abs(setpoint.values[lowest:highest] - at).max(axis=1) <= limits.MOVING_RAD_S * 0.03
    first, last = begin, end
    while first > lowest and near[first - 1 - lowest]:
        first -= 1
    while last < highest and near[last - lowest]:
        last += 1
    return first, last


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
    if stand is None or stand.to_s - window.to_s < limits.SETTLED_AFTER_S:
        return Unsettled(Outcome.NOT_DETERMINABLE)
    own = _cut(track, max(window.from_s, stand.from_s), window.to_s).values
    late_from_s = max(window.to_s, 0.5 * (window.to_s + stand.to_s))
    late = _cut(track, late_from_s, stand.to_s).values
    if len(own) < 2 or len(late) < 2 * limits.SETTLING_BLOCK:
        return Unsettled(Outcome.NOT_DETERMINABLE)
    missing = late.mean(axis=0) - own.mean(axis=0)
    white = np.maximum(white_noise(late), _slow(late))
    white = np.where(np.isfinite(white) & (white > 0.0), white, np.finfo(float).tiny)
    sigma = white * np.sqrt(1.0 / len(own) + 1.0 / len(late))
    p = min(1.0, tests * len(missing) * float(2.0 * ndtr(-np.max(np.abs(missing) / sigma))))
    if p >= limits.SETTLING_ALPHA or np.all(np.abs(missing) < limits.MISSED_SIGMAS * white):
        return Unsettled(Outcome.ABSENT, missing, sigma, p=p)
    settling = _cut(track, stand.from_s, stand.to_s)
    return Unsettled(Outcome.FOUND, missing, sigma, *_decay(settling, window, white), p=p)


def _cut(track: Track, from_s: float, to_s: float) -> Track:
    """Ends included, of a track in rising time."""
    t = track.time_s
    return track.take(slice(int(np.searchsorted(t, from_s)), int(np.searchsorted(t, to_s, side="right"))))


def _slow(values: Floats) -> Floats:
    """(channel,) sigma of a sample that the scatter of means of BLOCK samples stands for."""
    whole = len(values) // limits.SETTLING_BLOCK * limits.SETTLING_BLOCK
    means = values[:whole].reshape(-1, limits.SETTLING_BLOCK, values.shape[1]).mean(axis=1)
    if len(means) < 4:
        return np.zeros(values.shape[1])
    return np.sqrt(limits.SETTLING_BLOCK * np.mean(np.diff(means, axis=0) ** 2, axis=0) / 2.0)


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
