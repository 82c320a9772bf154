"""Does what a model leaves hang together in time, beyond noise that wanders: level, blocks, repeats.

Rows left out are missed by (I - H)^-1 r, whose size by noise alone is known; so a block of neighbours that is left out
may be missed by more than rows at random, but not than such a block of noise. Source of the identity: Cook, Weisberg,
Residuals and Influence in Regression, 1982, section 2.2. Null: noise drawn as the session shows it (noise_law.py).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.special import ndtr

from calibrate.diagnose import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.noise_law import NoiseLaw, capture_orders, noise_law
from calibrate.diagnose.search.null import Tail
from calibrate.diagnose.state.linearised import WhitenedRows
from calibrate.model.checks.gross_error import postures

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

AT_ONCE = 50
RIDGE = 1e-9


@dataclass(frozen=True)
class TimeLeft:
    """The test that noise passes least."""

    what: str
    ratio: float  # of the statistic to its mean by noise
    p: float  # of all tests together


def time_left(bench: Bench, rng: Generator) -> TimeLeft | None:
    """None where nothing hangs together in time, or where rows are too few."""
    rows, t_s = bench.state.rows, bench.state.drivers.t_s
    sample = np.where(rows.data, rows.sample, -1)
    used = np.unique(sample[sample >= 0])
    if len(used) < limits.FEWEST_TIMED:
        return None
    order = used[np.argsort(t_s[used], kind="stable")]
    tests = {
        "readings before and after some moment differ": _level(rows, t_s),
        "blocks of the session are predicted worse than rows at random": _blocks(bench, order),
    }
    if (pairs := _by_gap(bench)) is not None:
        tests["repeats disagree more, the farther apart in time they were taken"] = pairs
    if (ordered := along_the_way(bench, order)) is not None:
        return ordered
    law = _short(noise_law(rows, bench.sight, t_s, rng))
    nulls: dict[str, list[Floats]] = {what: [] for what in tests}
    for _ in range(limits.TIME_DRAWS // AT_ONCE):
        drawn = bench.sight.complement(law.draw(rng, AT_ONCE).T)
        for what, value_of in tests.items():
            nulls[what].append(value_of(drawn))
    found: list[TimeLeft] = []
    for what, value_of in tests.items():
        null, seen = np.concatenate(nulls[what]), float(value_of(bench.sight.residual[None])[0])
        p = min(1.0, len(tests) * Tail(null).p(seen))
        found.append(TimeLeft(what, seen / max(float(np.mean(null)), 1e-300), p))
    worst = min(found, key=lambda one: one.p)
    return worst if worst.p < limits.TIME_ALPHA and worst.ratio > limits.TIME_FACTOR else None


def along_the_way(bench: Bench, order: Ints) -> TimeLeft | None:
    """Where neighbours in the order of capture are neighbours in posture, too, and err alike: a wander of the noise and
    an error that changes smoothly with the angles cannot be separated there, so that what is left is not called noise.

    `order` (sample,) by time. None where the poses change at random, or the errors do. Level of a correlation of n
    pairs by noise: Fisher's z, sigma 1 / sqrt(n - 3).
    """
    q = postures(bench.state.drivers.q_rad)[order]
    step = np.linalg.norm(np.diff(q, axis=0), axis=1)
    moved = np.flatnonzero(step > limits.SAME_POSTURE)
    apart = np.linalg.norm(q[moved] - q[(moved + len(q) // 2) % len(q)], axis=1)
    if len(moved) < limits.FEWEST_TIMED or np.median(step[moved]) > limits.ORDERED_STEP * np.median(apart):
        return None
    worst = 0.0
    for at in capture_orders(bench.state.rows, bench.state.drivers.t_s):
        if len(at) != len(order):
            continue  # an instrument that has not read every pose
        z = bench.sight.residual[at]
        one, two = z[moved], z[moved + 1]
        worst = max(worst, float(np.sum(one * two) / np.sqrt(np.sum(one**2) * np.sum(two**2))))
    p = float(ndtr(-np.arctanh(min(worst, 1.0 - 1e-12)) * np.sqrt(len(moved) - 3.0)))
    if worst < limits.ALIKE_ALONG or p > limits.TIME_ALPHA:
        return None
    what = (
        f"neighbours in the order of capture err alike (correlation {worst:.2f}), and their postures are neighbours, "
        "too: noise that wanders or an error that follows the angles; measure the poses again in random order"
    )
    return TimeLeft(what, 1.0 / max(1.0 - worst, 1e-3), p)


def _short(law: NoiseLaw) -> NoiseLaw:
    """With wander that lasts for some neighbours only: what lasts for much of a session is not noise."""
    series = tuple(
        replace(
            s,
            wander=replace(
                s.wander,
                rho=min(s.wander.rho, limits.WANDER_CORRELATION),
                share=min(s.wander.share, limits.WANDER_SHARE),
            ),
        )
        for s in law.series
    )
    return replace(law, series=series)


Value = Callable[[Floats], Floats]  # (draw, row) of residuals behind geometry -> (draw,)


def _level(rows: WhitenedRows, t_s: Floats) -> Value:
    """Squares that a change of every channel's mean explains at the moment that suits it best, over the mean square."""
    orders = capture_orders(rows, t_s)

    def value(residual: Floats) -> Floats:
        best = np.zeros(len(residual))
        for at in orders:
            z = residual[:, at]  # (draw, time, channel)
            n = z.shape[1]
            before = np.arange(1, n)
            gone = np.cumsum(z, axis=1)[:, :-1] - before[:, None] / n * np.sum(z, axis=1, keepdims=True)
            explained = np.sum(gone**2, axis=2) * n / (before * (n - before))
            inner = explained[:, int(limits.TIME_EDGE * n) : n - int(limits.TIME_EDGE * n)]
            best = np.maximum(best, inner.max(axis=1) / np.mean(z**2, axis=(1, 2)))
        return best

    return value


def _blocks(bench: Bench, order: Ints) -> Value:
    """Squares by which each block of neighbours in time is missed when it is left out, over those of all rows."""
    sample, basis = bench.state.rows.sample, bench.sight.basis
    data = np.flatnonzero(bench.state.rows.data)
    blocks = [data[np.isin(sample[data], part)] for part in np.array_split(order, limits.TIME_BLOCKS)]

    def value(residual: Floats) -> Floats:
        missed = np.zeros(len(residual))
        for block in blocks:
            Q, r = basis[block], residual[:, block].T
            inside = (1.0 + RIDGE) * np.eye(Q.shape[1]) - Q.T @ Q
            missed += np.sum(r * (r + Q @ np.linalg.solve(inside, Q.T @ r)), axis=0)
        return missed / np.sum(residual[:, data] ** 2, axis=1)

    return value


def _by_gap(bench: Bench) -> Value | None:
    """Squared differences of repeats that are farther apart in time than usual, over those that are nearer."""
    rows, drivers = bench.state.rows, bench.state.drivers
    if drivers.repeat is None:
        return None
    a, b, gap_s = repeat_pairs(drivers.repeat, drivers.t_s, rows.sample, rows.group, rows.instrument)
    if len(np.unique(gap_s)) < limits.FEWEST_TIMED_PAIRS:
        return None
    far = gap_s > np.median(gap_s)

    def value(residual: Floats) -> Floats:
        square = (residual[:, a] - residual[:, b]) ** 2
        return np.mean(square[:, far], axis=1) / np.maximum(np.mean(square[:, ~far], axis=1), 1e-300)

    return value


def repeat_pairs(repeat: Ints, t_s: Floats, sample: Ints, group: Ints, instrument: Ints) -> tuple[Ints, Ints, Floats]:
    """(pair,) rows of one channel of one instrument at two visits of one pose, and the time between them."""
    label = np.where(sample >= 0, repeat[np.maximum(sample, 0)], -1)
    one, other, gap = list[Ints](), list[Ints](), list[Floats]()
    for pose in np.unique(label[label >= 0]):
        mine = np.flatnonzero(label == pose)
        for i in np.unique(instrument[mine]):
            here = mine[instrument[mine] == i]
            visits = [here[group[here] == g] for g in np.unique(group[here])]
            k = min(len(v) for v in visits)
            at = np.stack([v[:k] for v in visits])
            first, second = np.triu_indices(len(at), 1)
            one.append(at[first].ravel())
            other.append(at[second].ravel())
            gap.append(np.abs(t_s[sample[at[first].ravel()]] - t_s[sample[at[second].ravel()]]))
    if not one:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp), np.zeros(0)
    return np.concatenate(one), np.concatenate(other), np.concatenate(gap)
