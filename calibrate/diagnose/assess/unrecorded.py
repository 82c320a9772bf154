"""Scatter with the signature of a port: something moves there that no column of the record follows.

A driver that was not recorded turns physics into noise, but noise that goes through the lever of its port: larger where
the lever is long. Variance is put on every port in turn, over and above what is innocent (joint_scatter.py), and the
likelihood asked which one wants it; pairing residuals with other poses gives the null. Sources: Kristensen, Madsen,
Jorgensen, Automatica 40(2), 2004; exchangeable rows: Westfall, Young, Resampling-based multiple testing, 1993.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.joint_scatter import (
    LOUDNESS,
    Innocent,
    innocent,
    spectrum,
)
from calibrate.diagnose.assess.missing_columns import TIME, Wish, wishes
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.null import Tail
from calibrate.diagnose.search.port_process import lever
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Missing

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Unrecorded:
    """Where scatter sits that is no noise of the instrument."""

    port: Port
    gain: float  # 2 ln L
    p: float
    share: float  # of the residual's variance
    missing: tuple[Missing, ...]  # columns that would have to move so, of those that the record lacks


def unrecorded(bench: Bench, rng: Generator, missing: Sequence[Missing] = ()) -> Unrecorded | None:
    """The port that wants a random value at every sample most; None where none does significantly."""
    asked = wishes(bench, missing)
    blocks = _blocks(bench)
    if not blocks or not asked:
        return None
    residual = _leverage_corrected(bench)
    seen, restless = np.zeros((len(asked), len(LOUDNESS))), 0.0
    null = np.zeros((*seen.shape, limits.SCATTER_DRAWS))
    for instrument, mine in blocks.items():
        unwhiten = _unwhitener(bench, instrument, mine)
        raw, levers = _turned(unwhiten, residual[mine]), [_felt(unwhiten, w, mine) for w in asked]
        base = _base(raw, asked, levers)
        restless += base.restless
        z = _turned(base.whitener, raw)
        drawn = np.stack([z, *(z[rng.permutation(len(z))] for _ in range(limits.SCATTER_DRAWS))], axis=2)
        for i, lever_of in enumerate(levers):
            if asked[i].port.where == TIME:
                continue
            felt = np.stack([_turned(base.whitener, one) for one in lever_of])
            gains = _gains(felt, drawn)
            seen[i] += gains[:, 0]
            null[i] += gains[:, 1:]
    best = seen.max(axis=1)
    p = Tail(null.max(axis=(0, 1))).p(float(best.max()))
    moving = next((w for w in asked if w.port.where == TIME), None)
    if moving is not None and restless > max(limits.RESTLESS, float(best.max()) if p <= limits.SCATTER_ALPHA else 0.0):
        return Unrecorded(moving.port, restless, float(np.exp(-restless / 2.0)), 0.5, moving.missing)
    if best.max() <= 0.0 or p > limits.SCATTER_ALPHA:
        return None
    at = _said(asked, best)
    loud = LOUDNESS[int(np.argmax(seen[at]))]
    near = [w for w, gain in zip(asked, best, strict=True) if gain >= best.max() - limits.PORTS_TIED]
    lacking = tuple(dict.fromkeys(m for w in near for m in w.missing))
    return Unrecorded(asked[at].port, float(best[at]), p, loud / (1.0 + loud), lacking)


def _base(raw: Floats, asked: Sequence[Wish], levers: Sequence[Floats]) -> Innocent:
    """The innocent scatter; the joints' has no part in it where a single port explains more than all joints do."""
    joints = next((one for w, one in zip(asked, levers, strict=True) if w.port.where == TIME), None)
    plain = innocent(raw, np.zeros((1, *raw.shape)))
    if joints is None:
        return plain
    through = innocent(raw, joints)
    z = _turned(plain.whitener, raw)
    felt = [
        np.stack([_turned(plain.whitener, x) for x in one])
        for w, one in zip(asked, levers, strict=True)
        if w.port.where != TIME
    ]
    alone = max(float(_gains(one, z[..., None]).max()) for one in felt)
    return plain if plain.two_log_likelihood + alone > through.two_log_likelihood + limits.PORTS_TIED else through


def _said(asked: Sequence[Wish], best: Floats) -> int:
    """The best of those whose column is missing, where it is as good as any."""
    known = np.array([best[i] if w.missing else -np.inf for i, w in enumerate(asked)])
    return int(np.argmax(known if known.max() >= best.max() - limits.PORTS_TIED else best))


def _gains(felt: Floats, z: Floats) -> Floats:
    """(loudness, draw) of residuals z (observation, k, draw) with levers (lever, observation, k), noise estimated."""
    w, V = spectrum(felt)
    turned = ((np.swapaxes(V, 1, 2) @ z) ** 2).reshape(w.size, -1)
    width = 1.0 + np.array(LOUDNESS)[:, None] * w.reshape(-1)
    left = (1.0 / width) @ turned
    return w.size * np.log(np.sum(turned, axis=0) / left) - np.sum(np.log(width), axis=1)[:, None]


def _leverage_corrected(bench: Bench) -> Floats:
    """(row,) what geometry follows is no sign of a port."""
    leverage = np.minimum(np.sum(bench.sight.basis**2, axis=1), 0.9)
    return bench.sight.residual / np.sqrt(1.0 - leverage)


def _unwhitener(bench: Bench, instrument: int, mine: Ints) -> Floats:
    """(observation, k, k) from rows as whitened, weights included, to rows in the instrument's unit.

    No robust weights: where few poses feel the cause, it is the gross errors that show it; the null holds them, too.
    """
    names, k = list(bench.state.drivers.readouts), mine.shape[1]
    if instrument >= len(names):
        return np.broadcast_to(np.eye(k), (len(mine), k, k))
    port = Port("", Place.READING, instrument=names[instrument])
    whitener = np.stack([lever(bench, port, c)[mine] for c in range(k)], axis=2)
    return np.asarray(np.linalg.inv(whitener), dtype=np.float64)


def _felt(unwhiten: Floats, wish: Wish, mine: Ints) -> Floats:
    """(lever, observation, k) in the instrument's unit."""
    return np.stack([_turned(unwhiten, one[mine]) for one in wish.levers])


def _turned(by: Floats, rows: Floats) -> Floats:
    return np.einsum("oij,oj->oi", by, rows)


def _blocks(bench: Bench) -> dict[int, Ints]:
    """(observation, k) row numbers of every instrument."""
    rows = bench.state.rows
    out: dict[int, Ints] = {}
    for instrument in np.unique(rows.instrument[rows.data]):
        mine = np.flatnonzero(rows.data & (rows.instrument == instrument))
        k = int(np.sum(rows.group[mine] == rows.group[mine[0]]))
        if k * limits.SCATTER_OBSERVATIONS <= len(mine):
            out[int(instrument)] = mine.reshape(-1, k)
    return out
