"""Encoders on one shaft, each against the first: what turns once with the shaft, steps that stay, noise, pace.

Nothing but the encoders is needed: motion is common to both and cancels. Reading k less reading 1 of the same SYNC:

    d = level + drift t + a cos q + b sin q + a2 cos 2q + b2 sin 2q + steps + noise

Once a turn is the eccentricity of both discs together, twice their ellipse (Bai and Teo 2002); of which disc it is, the
difference does not show. Steps as in `slips`, over intervals of time in place of stands; one that is no larger than
what is left of the difference beyond noise counts for nothing, since graduation errors change in steps, too.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.clock import fit
from calibrate.diagnose.streams.recorded import StreamDevice
from calibrate.diagnose.streams.slips import Slip, steps_in
from calibrate.diagnose.streams.track import white_noise
from calibrate.model.effects.term import Size

Floats = NDArray[np.float64]

INTERVALS = 200  # of time, between which steps are sought
BLOCKS = 40  # of time that are left out in turn, for the sigma
FEWEST = 4 * INTERVALS  # rows
MOVES_RAD = 0.02  # more than discs off their centres differ by; below, the shaft stands
BEYOND = 5.0  # of what is left of the difference, for a step
TURN_RAD = 2.0 * np.pi


@dataclass(frozen=True)
class EncoderPair:
    """Encoder `number` (from 1) against encoder 1. `why`: what is not determined, and the reason; "" where all is.

    `once_rad`: amplitude of what turns once with the shaft. `noise_rad`: of one reading of one of both, on average.
    """

    number: int
    once_rad: Size | None = None
    noise_rad: float | None = None
    slips: tuple[Slip, ...] = ()
    why: str = ""
    level_rad: Size | None = None  # encoder `number` less encoder 1 in its own sense, modulo a turn


@dataclass(frozen=True)
class Pace:
    """Of the rows: period (s), scatter of the time between two (one sigma, s), longest time between two (s)."""

    period_s: float
    jitter_s: float
    longest_s: float


def pace_of(device: StreamDevice) -> Pace | None:
    """By the device's stamps, missing rows taken out by their numbers. None for fewer than three rows."""
    rows, step_s = np.diff(device.sequence), np.diff(device.track.time_s)
    good = rows > 0
    if np.count_nonzero(good) < 2:
        return None
    each_s = step_s[good] / rows[good]
    return Pace(float(np.median(each_s)), float(np.std(step_s[good & (rows == 1)])), float(step_s.max()))


def examine_encoders(device: StreamDevice) -> tuple[Pace | None, tuple[EncoderPair, ...]]:
    """The pace of the rows, and every encoder but the first against the first."""
    return pace_of(device), tuple(_pair(device, k) for k in range(1, device.track.channels))


def _pair(device: StreamDevice, k: int) -> EncoderPair:
    values = device.track.values[:, [0, k]]
    good = np.isfinite(values).all(axis=1)
    (q, other), t = values[good].T, device.track.time_s[good]
    if len(q) < FEWEST:
        return EncoderPair(k + 1, why=f"fewer than {FEWEST} rows in which both answered")
    q_moves, other_moves = q - q.mean(), other - other.mean()
    sense = 1.0 if float(q_moves @ other_moves) >= 0.0 else -1.0
    d = other_moves - sense * q_moves
    noise = float(white_noise(d[:, None])[0]) / np.sqrt(2.0)
    moves = max(float(np.ptp(q)), float(np.ptp(other))) > MOVES_RAD
    if moves and float(np.std(d)) > max(limits.UNLIKE * float(np.std(q)), BEYOND * noise):
        return EncoderPair(
            k + 1, why=f"it does not follow encoder 1 one to one (they differ by {np.std(d):.3g} rad rms)"
        )
    turned, level = float(np.ptp(q)), _level(other - sense * q, limits.USUAL_DISC_RAD)
    if turned < TURN_RAD:
        why = f"eccentricity: the shaft turns through {np.degrees(turned):.0f}°, not 360°"
        return EncoderPair(k + 1, noise_rad=noise, why=why, level_rad=level)
    X = np.stack([np.ones(len(q)), np.cos(q), np.sin(q), np.cos(2.0 * q), np.sin(2.0 * q), t - t.mean()], axis=1)
    slips = _steps(k + 1, t, d, X, device.track.channels)
    stepped = np.column_stack([X, *((t >= slip.to_s).astype(float) for slip in slips)])
    apart = ~np.any([(t > slip.from_s) & (t < slip.to_s) for slip in slips] or [np.zeros(len(t), dtype=bool)], axis=0)
    block = np.minimum(np.arange(len(t)) * BLOCKS // len(t), BLOCKS - 1)
    found = fit(stepped[apart], d[apart], block[apart])
    if found is None:
        why = "eccentricity: the motion does not show it"
        return EncoderPair(k + 1, noise_rad=noise, slips=slips, why=why, level_rad=None if slips else level)
    a, b = found.values[1:3]
    size = float(np.hypot(a, b))
    along = np.array([a, b]) / max(size, 1e-300)
    sigma = float(np.sqrt(along @ found.covariance[1:3, 1:3] @ along))
    middle = float(other.mean() - sense * q.mean() + found.values[0])
    level = _level(np.array([middle]), found.sigma[0])
    return EncoderPair(k + 1, Size(size, sigma), noise, slips, level_rad=None if slips else level)


def _level(difference: Floats, sigma_rad: float) -> Size:
    """Its middle on the circle."""
    return Size(float(np.angle(np.mean(np.exp(1j * difference)))), float(sigma_rad))


def _steps(number: int, t: Floats, d: Floats, X: Floats, encoders: int) -> tuple[Slip, ...]:
    """Begin and end of the interval at which a step is, for each that is larger than what nothing explains."""
    rows = np.array_split(np.arange(len(t)), INTERVALS)
    mean = np.array([d[r].mean() for r in rows])
    columns = [np.array([X[r, c].mean() for r in rows]) for c in range(X.shape[1])]
    ends = np.array([[t[r[0]], t[r[-1]]] for r in rows])
    found = steps_in(number, ends, columns, mean, INTERVALS * encoders)
    base = np.stack([*columns, *((ends[:, 0] >= one.to_s).astype(float) for one in found)], axis=1)
    left = mean - base @ np.linalg.lstsq(base, mean, rcond=None)[0]
    whole = _whole([one for one in found if abs(one.size_rad) > BEYOND * float(np.std(left))], 1.5 * np.ptp(ends[0]))
    return tuple(whole)


def _whole(found: list[Slip], apart_s: float) -> list[Slip]:
    """In order of time; a step within an interval is found at both of its ends, and is one."""
    out: list[Slip] = []
    for one in sorted(found, key=lambda slip: slip.from_s):
        if out and one.from_s - out[-1].to_s <= apart_s:
            first = out.pop()
            sigma_rad = float(np.hypot(first.sigma_rad, one.sigma_rad))
            size_rad, p = first.size_rad + one.size_rad, min(first.p, one.p)
            out.append(Slip(one.joint, first.from_s, one.to_s, size_rad, sigma_rad, p))
        else:
            out.append(one)
    return out
