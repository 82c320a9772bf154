"""Offset and drift between the clocks of two streams of one motion, to a fraction of a sample.

    other(t) = reference(t + offset + drift (t - middle)) + what stays nearly even within a block of time

Found by least squares on the curve of the reference (maximum likelihood of a delay: Knapp and Carter, IEEE ASSP 24,
1976), each block with its own level and gain, so that zeros, slips and a model that is a little off do not count as
time. Standing blocks show nothing about time and are left out.
"""

from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams.clustered import fit
from calibrate.diagnose.streams.coarse_clock import Ticks, coarse
from calibrate.diagnose.streams.track import Curve, Track, white_noise

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

BLOCK_S = 0.5  # a motion of an arm from pose to pose; what is slower than this is level
TOGETHER = 2  # blocks: errors of a reading that depend on the angle last as long as a motion does
ROUNDS = 12  # Gauss-Newton from a start within its reach needs five
STILL_S = 1e-9  # step at which it has converged
MOVES = 20.0  # times the noise that a block must move to show something about time
FEWEST_BLOCKS = 5  # of those together
USELESS_S = 1e-3  # a sigma beyond this is no answer: ten times what is asked for, and what unlike motions leave


class ClockStatus(Enum):
    """How the comparison of two clocks ended."""

    FOUND = "offset found"
    DOES_NOT_MOVE = "too little motion in both streams at once"
    UNRELATED = "the two streams do not show the same motion"
    UNEVEN = "stamped by the host, whose pace against the joints' clock changes: slips are sought, lags are not"


@dataclass(frozen=True)
class ClockFit:
    """Numbers are None unless FOUND; `drift` None, too, where the motion is too short to show one."""

    status: ClockStatus
    offset_s: float | None = None  # at `middle_s`: add to a time of the other stream to read the reference's clock
    offset_sigma_s: float | None = None
    drift: float | None = None  # s/s
    drift_sigma: float | None = None
    middle_s: float = 0.0  # on the other stream's clock

    def to_reference(self, time_s: Floats) -> Floats:
        """Times of the other stream on the reference's clock. ValueError when there is no offset."""
        if self.offset_s is None:
            raise ValueError(f"clocks: {self.status.value}; nothing can be converted")
        return time_s + self.offset_s + (self.drift or 0.0) * (time_s - self.middle_s)


def clock_between(reference: Track, other: Track, start: Ticks | None = None) -> ClockFit:
    """Channels must be the same quantities in the same order; `start` from stamps of the host, where there are any."""
    curve, reference, other = reference.curve, reference.read(), other.read()
    ticks = coarse(reference, other, start)
    if ticks is None:
        return ClockFit(ClockStatus.DOES_NOT_MOVE)
    noise = _noise(reference, other)
    middle_s = float(other.time_s.mean())
    found = np.array([ticks.offset_s + ticks.rate_error * (middle_s - ticks.at_s), ticks.rate_error])
    line, steps = None, np.inf
    for _ in range(ROUNDS):
        rows = _rows(curve, other, noise, middle_s, found)
        if rows is None:
            return ClockFit(ClockStatus.DOES_NOT_MOVE)
        line = fit(*rows)
        if line is None:
            line = fit(rows[0][:, :1], *rows[1:])
        if line is None:
            return ClockFit(ClockStatus.DOES_NOT_MOVE)
        steps = line.values
        found[: len(steps)] += steps
        if abs(steps[0]) < STILL_S:
            break
    if line is None or abs(float(np.ravel(steps)[0])) > 1e-6 or not line.sigma[0] < USELESS_S:
        return ClockFit(ClockStatus.UNRELATED)
    drifting = len(line.values) > 1
    return ClockFit(
        ClockStatus.FOUND,
        float(found[0]),
        float(line.sigma[0]),
        float(found[1]) if drifting else None,
        float(line.sigma[1]) if drifting else None,
        middle_s,
    )


def _noise(reference: Track, other: Track) -> Floats:
    noise = np.hypot(white_noise(reference.values), white_noise(other.values))
    span = np.nanmax(np.abs(other.values - other.values.mean(axis=0)), axis=0)
    return np.maximum(noise, 1e-9 * np.maximum(span, 1e-300))


def _rows(
    curve: Curve, other: Track, noise: Floats, middle_s: float, found: Floats
) -> tuple[Floats, Floats, Ints] | None:
    """Columns of offset and drift, residual, block, in sigmas; level and gain of every block and channel taken out."""
    since_s = other.time_s - middle_s
    at_s = other.time_s + found[0] + found[1] * since_s
    expected, rate = curve.at(at_s), curve.rate(at_s)
    block = np.floor((other.time_s - other.time_s[0]) / BLOCK_S).astype(np.intp)
    good = np.all(np.isfinite(expected), axis=1)
    apart = other.values - expected
    X: list[Floats] = []
    y: list[Floats] = []
    of: list[Ints] = []
    edges = np.flatnonzero(np.diff(block, prepend=-1, append=-1))
    for begin, end in pairwise(edges):
        one, rows = int(block[begin]), begin + np.flatnonzero(good[begin:end])
        if len(rows) < 8:
            continue
        moves = np.flatnonzero(np.ptp(expected[rows], axis=0) > MOVES * noise)
        if not len(moves):
            continue
        at = np.ix_(rows, moves)
        angle = expected[at] - expected[at].mean(axis=0)
        slope, left = rate[at] / noise[moves], apart[at] / noise[moves]
        both = np.stack([slope, slope * since_s[rows, None], left], axis=2)
        both -= both.mean(axis=0)
        both -= angle[:, :, None] * np.einsum("nc,nck->ck", angle / np.sum(angle**2, axis=0), both)
        X.append(both[:, :, :2].reshape(-1, 2))
        y.append(both[:, :, 2].ravel())
        of.append(np.full(both[:, :, 2].size, one // TOGETHER, dtype=np.intp))
    if len(np.unique([int(o[0]) for o in of])) < FEWEST_BLOCKS:
        return None
    return np.concatenate(X), np.concatenate(y), np.concatenate(of)
