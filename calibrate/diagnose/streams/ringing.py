"""Ringing after a stop: how fast, how damped, how large, and which joint swings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.damped import Swing, chance, swing
from calibrate.diagnose.streams.settling import Stand
from calibrate.diagnose.streams.track import Outcome, Track, white_noise

Floats = NDArray[np.float64]
Levers = Callable[[float], Floats]  # time of the stream -> (channel, joint) what a turn of each joint does to it


@dataclass(frozen=True)
class Ringing:
    """Over all stops that ring together. `joint` is None where no lever was given or none explains it."""

    outcome: Outcome
    frequency_hz: float | None = None
    frequency_sigma_hz: float | None = None
    damping: float | None = None
    damping_sigma: float | None = None
    amplitude: float | None = None  # largest channel and stop, in the unit of the track
    stops: int = 0
    joint: int | None = None
    rivals: tuple[int, ...] = ()
    from_s: float | None = None
    p: float = 1.0


def ringing(track: Track, stands: Sequence[Stand], levers: Levers | None = None, after_s: float = 0.0) -> Ringing:
    """Of a spot, encoder or joint stream. `after_s`: what the servo still needs after the set-point stands."""
    seen: list[tuple[Stand, float, Swing, float]] = []
    looked = 0
    track = track.read()
    for stand in stands:
        window = track.between(
            stand.from_s + after_s, min(stand.to_s, stand.from_s + after_s + limits.RINGING_WINDOW_S)
        )
        if len(window.time_s) < limits.RINGING_SAMPLES:
            continue
        looked += 1
        if not np.any(np.ptp(window.values, axis=0) > 0.0):
            continue  # not one count: nothing swings
        found = swing(window.time_s, window.values, _noise(window.values))
        if found is not None:
            seen.append(
                (
                    stand,
                    float(window.time_s[0]),
                    found,
                    chance(found.squares_before, found.squares_after, found.numbers, window.values.size),
                )
            )
    if not looked:
        return Ringing(Outcome.NOT_DETERMINABLE)
    sure = [one for one in seen if one[3] * looked < limits.RINGING_ALPHA]
    if not sure:
        return Ringing(Outcome.ABSENT)
    alike = _alike(sure)
    return _joined(alike, levers, looked) if len(alike) >= limits.RINGING_STOPS * looked else Ringing(Outcome.ABSENT)


def _noise(values: Floats) -> Floats:
    """(channel,) white noise; a channel that is quantised or flat counts by its own finest step."""
    noise = white_noise(values)
    steps = np.abs(np.diff(values, axis=0))
    finest = np.array([np.min(c[c > 0.0], initial=np.inf) for c in steps.T])
    floor = np.where(np.isfinite(finest), finest / np.sqrt(12.0), 1.0)
    return np.maximum(np.where(np.isfinite(noise), noise, 0.0), np.where(noise > 0.0, 0.0, floor))


def _alike(sure: list[tuple[Stand, float, Swing, float]]) -> list[tuple[Stand, float, Swing, float]]:
    """Stops that ring with the frequency of the strongest: another frequency is another part."""
    strongest = min(sure, key=lambda one: one[2].frequency_sigma_hz / one[2].frequency_hz)
    near = 0.1 * strongest[2].frequency_hz
    return [one for one in sure if abs(one[2].frequency_hz - strongest[2].frequency_hz) < near]


def _joined(sure: list[tuple[Stand, float, Swing, float]], levers: Levers | None, looked: int) -> Ringing:
    swings = [one[2] for one in sure]
    frequency = _mean([s.frequency_hz for s in swings], [s.frequency_sigma_hz for s in swings])
    damping = _mean([s.damping for s in swings], [s.damping_sigma for s in swings])
    joint, rivals = _joint(sure, levers)
    p = float(chdtrc(2 * len(sure), -2.0 * sum(np.log(max(one[3], 1e-300)) for one in sure)))  # Fisher 1925
    return Ringing(
        Outcome.FOUND,
        *frequency,
        *damping,
        float(max(np.max(np.abs(s.amplitude)) for s in swings)),
        len(sure),
        joint,
        rivals,
        sure[0][1],
        min(1.0, p * looked),
    )


def _mean(values: list[float], sigmas: list[float]) -> tuple[float, float]:
    """Weighted; the sigma is widened where stops differ by more than they state (Birge ratio, Phys. Rev. 40, 1932)."""
    v, s = np.array(values), np.maximum(np.array(sigmas), 1e-12)
    w = 1.0 / s**2
    mean = float(np.sum(w * v) / np.sum(w))
    birge = np.sqrt(max(1.0, float(np.sum(w * (v - mean) ** 2)) / max(len(v) - 1, 1)))
    return mean, float(birge / np.sqrt(np.sum(w)))


def _joint(sure: list[tuple[Stand, float, Swing, float]], levers: Levers | None) -> tuple[int | None, tuple[int, ...]]:
    """The joint (from 1) whose lever explains the shape of the swing in all stops, and those that do nearly as well."""
    if levers is None:
        return None, ()
    explained, total = 0.0, 0.0
    for _, at_s, one, _ in sure:
        lever = levers(at_s) / one.amplitude_sigma[:, None]
        if not lever.any():  # the model has no reading there: between two places, for example
            continue
        amplitude = one.amplitude / one.amplitude_sigma
        size = np.linalg.norm(lever, axis=0)
        unit = lever / np.where(size > 0.0, size, 1.0)
        explained = explained + np.abs(unit.T @ amplitude) ** 2
        total += float(np.sum(np.abs(amplitude) ** 2))
    if not total:
        return None, ()
    share = np.asarray(explained) / total
    best = int(np.argmax(share))
    if share[best] < limits.RINGING_JOINT:
        return None, ()
    return best + 1, tuple(
        int(i) + 1 for i in np.flatnonzero(share > share[best] - limits.RINGING_JOINTS_TIED) if i != best
    )
