"""Offset and drift between the clocks of two streams of one motion, to a fraction of a sample.

    other(t) = reference(t + offset + drift (t - middle)) + what stays nearly even within a block of time

Found by least squares on the curve of the reference (maximum likelihood of a delay: Knapp and Carter, IEEE ASSP 24,
1976), each block with its own level and gain, so that zeros, slips and a model that is a little off do not count as
time. Standing blocks show nothing about time and are left out.

Least squares on streams with a sigma that neighbouring samples cannot make too small.

Residuals of a stream hang together: noise is filtered, models are off a little for a while. So whole blocks of time
are left out in turn (jackknife: Efron, SIAM CBMS 38, 1982, chapter 3; with clusters: MacKinnon, Nielsen, Webb, J.
Applied Econometrics 38, 2023). Only blocks are taken as independent:

    V = (B - 1) / B sum_b d_b d_b',  d_b = (H - H_b)^-1 X_b' psi(r_b),  H = X' psi'(r) X

psi is Huber's: rows beyond its bend still pull, but do not hold, so they count in the pull and not in H (Huber 1981,
section 7.6). Its scale is the usual residual of the rows that decide, those with much X: stamps that tremble make
residuals grow with speed, and rows that hardly move would call every fast one wild.
"""

from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams import limits
from calibrate.diagnose.streams.coarse_clock import Ticks, coarse
from calibrate.diagnose.streams.track import SIGMA_OF_MEDIAN, Track, TrackCurve, white_noise

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

HUBER = 1.345  # sigmas: 95 % efficiency on normal noise (Huber 1981, section 4.5)
SINGULAR = 1e-10  # of the scaled normal matrix: below, a combination is not seen


@dataclass(frozen=True)
class RobustLine:
    """Solution of a linear fit; `covariance` NaN where the data do not determine it."""

    values: Floats
    covariance: Floats
    blocks: int

    @property
    def sigma(self) -> Floats:
        return np.sqrt(np.diag(self.covariance))


def fit(X: Floats, y: Floats, block: Ints, rounds: int = 4) -> RobustLine | None:
    """Robust y = X b. `X` (row, k), `y` (row,), `block` (row,). None where X is singular or blocks are too few."""
    k, blocks = X.shape[1], len(np.unique(block))
    scale = np.linalg.norm(X, axis=0)
    if blocks <= k + 1 or not np.all(scale > 0.0):
        return None
    Z = X / scale
    if np.linalg.eigvalsh(Z.T @ Z)[0] < SINGULAR:
        return None
    weight, holds, b = np.ones(len(y)), np.ones(len(y)), np.zeros(k)
    deciding = np.sum(Z**2, axis=1)
    for again in range(rounds):
        if again:
            residual = y - Z @ b
            spread = SIGMA_OF_MEDIAN * _middle(np.abs(residual), deciding)
            if spread <= 0.0:
                break
            weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(residual), 1e-300))
            holds = (weight == 1.0).astype(float)
        normal = Z.T @ (weight[:, None] * Z)
        b = np.linalg.solve(normal, Z.T @ (weight * y))
    residual = y - Z @ b
    covariance = _jackknife(Z, weight * residual, holds, block) / np.outer(scale, scale)
    return RobustLine(b / scale, covariance, blocks)


def _middle(values: Floats, weight: Floats) -> float:
    """Weighted median."""
    order = np.argsort(values)
    passed = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(passed, 0.5 * passed[-1])]])


def _jackknife(Z: Floats, pull: Floats, holds: Floats, block: Ints) -> Floats:
    """Scatter of the solutions that leave one block out; blocks that hold much of the motion count in full."""
    _, at = np.unique(block, return_inverse=True)
    k, blocks = Z.shape[1], int(at.max()) + 1
    sums, own = np.zeros((blocks, k)), np.zeros((blocks, k, k))
    np.add.at(sums, at, Z * pull[:, None])
    np.add.at(own, at, holds[:, None, None] * Z[:, :, None] * Z[:, None, :])
    apart = np.linalg.solve(own.sum(axis=0) - own, sums[:, :, None])[:, :, 0]
    return (blocks - 1) / blocks * apart.T @ apart


ROUNDS = 12  # Gauss-Newton from a start within its reach needs five
STILL_S = 1e-9  # step at which it has converged


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
    if line is None or abs(float(np.ravel(steps)[0])) > 1e-6 or not line.sigma[0] < limits.USELESS_S:
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
    curve: TrackCurve, other: Track, noise: Floats, middle_s: float, found: Floats
) -> tuple[Floats, Floats, Ints] | None:
    """Columns of offset and drift, residual, block, in sigmas; level and gain of every block and channel taken out."""
    since_s = other.time_s - middle_s
    at_s = other.time_s + found[0] + found[1] * since_s
    expected, rate = curve.at(at_s), curve.rate(at_s)
    block = np.floor((other.time_s - other.time_s[0]) / limits.BLOCK_S).astype(np.intp)
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
        moves = np.flatnonzero(np.ptp(expected[rows], axis=0) > limits.BLOCK_MOVES * noise)
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
        of.append(np.full(both[:, :, 2].size, one // limits.BLOCKS_TOGETHER, dtype=np.intp))
    if len(np.unique([int(o[0]) for o in of])) < limits.FEWEST_BLOCKS:
        return None
    return np.concatenate(X), np.concatenate(y), np.concatenate(of)
