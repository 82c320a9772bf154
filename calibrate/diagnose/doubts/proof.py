"""The proof: geometry alone against geometry and terms on samples that neither has seen, both refitted without them.

Interval by a paired bootstrap over samples: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 8.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.doubts.folds import splits_of, units
from calibrate.diagnose.state.linearised import State, Unseen, tame
from calibrate.fit.held_out import Split
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

ROUNDS = 500
FEWEST_DOF = 20  # of repeats, for a floor
EXCHANGES, BY_CHANCE = 300, 0.01
POSITION = 3  # components of a reading that are lengths


@dataclass(frozen=True)
class HeldOut:
    """One split of one instrument; rms over all lengths it reads, wild observations left out of both."""

    split: str
    instrument: str
    observations: int
    wild: int
    rms_before_m: float
    rms_after_m: float
    removed: tuple[float, float]  # 95 % interval of the share of the squared error that the terms remove


@dataclass(frozen=True)
class Floor:
    """What remains unexplainable."""

    instrument: str
    rms_m: float
    source: str


def proofs(bare: State, full: State, samples: Ints, rng: Generator) -> tuple[HeldOut, ...]:
    """Every split that the session allows, every instrument; states without and with terms, fitted to all samples."""
    out: list[HeldOut] = []
    for split in splits_of(bare.drivers, samples, rng):
        out += _proof(bare, full, samples, split, rng)
    return tuple(out)


def floors(state: State, samples: Ints, parameters: int) -> tuple[Floor, ...]:
    """Of every instrument: robust scatter within repeats after the model, or what the fit leaves.

    Repeats far apart in time do not count where they disagree more than those that are nearer.
    """
    repeat, t_s, out = state.drivers.repeat, state.drivers.t_s, list[Floor]()
    seen = _lengths(state.held_out(samples))
    total = sum(u.misfit[:, :POSITION].size for u in seen)
    for u in seen:
        good = tame(u.whitened, 1.0)
        misfit = u.misfit[:, :POSITION]
        if repeat is not None:
            within = _within(misfit[good], repeat[u.sample[good]])
            if within is not None:
                near = near_in_time(misfit[good], repeat[u.sample[good]], t_s[u.sample[good]])
                source = "scatter within repeats, after the model"
                source = source if near is None else "scatter within repeats near in time, after the model"
                out.append(Floor(u.instrument, within if near is None else near, source))
                continue
        rms = float(np.sqrt(np.mean(misfit[good] ** 2) * total / max(total - parameters, 1)))
        out.append(Floor(u.instrument, rms, "what the fit leaves, corrected for its parameters"))
    return tuple(out)


def _proof(bare: State, full: State, samples: Ints, split: Split, rng: Generator) -> list[HeldOut]:
    before: list[Unseen] = []
    after: list[Unseen] = []
    for fold in split.unseen:
        known = np.setdiff1d(samples, fold)
        without = bare.select(known).refitted(()).held_out(fold)
        before += _lengths(without)
        after += _lengths(full.select(known).refitted(full.accepted).held_out(fold) if full.accepted else without)
    names = sorted({u.instrument for u in before})
    return [_compared(split.says, name, before, after, units(bare.drivers), rng) for name in names]


def _lengths(unseen: Sequence[Unseen]) -> list[Unseen]:
    """Without second encoders: angles between two readings of a joint are no error of the arm."""
    return [u for u in unseen if u.instrument != ENCODER_DIFFERENCE]


def _compared(
    split: str, name: str, before: Sequence[Unseen], after: Sequence[Unseen], labels: Ints, rng: Generator
) -> HeldOut:
    mine = [(b, a) for b, a in zip(before, after, strict=True) if b.instrument == name]
    good = np.concatenate([tame(a.whitened, 1.0) for _, a in mine])
    b = np.concatenate([u.misfit[:, :POSITION] for u, _ in mine])[good]
    a = np.concatenate([u.misfit[:, :POSITION] for _, u in mine])[good]
    label = labels[np.concatenate([u.sample for u, _ in mine])[good]]
    squares_b, squares_a = np.sum(b**2, axis=1), np.sum(a**2, axis=1)
    return HeldOut(
        split, name, len(b), int(np.sum(~good)), _rms(b), _rms(a), _interval(squares_b, squares_a, label, rng)
    )


def _interval(before: Floats, after: Floats, label: Ints, rng: Generator) -> tuple[float, float]:
    """Of 1 - after / before, samples of one pose drawn together."""
    _, unit = np.unique(label, return_inverse=True)
    b, a = np.bincount(unit, before), np.bincount(unit, after)
    if len(b) < 2:
        return (float("nan"), float("nan"))
    drawn = rng.integers(len(b), size=(ROUNDS, len(b)))
    shares = 1.0 - a[drawn].sum(axis=1) / np.maximum(b[drawn].sum(axis=1), 1e-300)
    low, high = np.percentile(shares, [2.5, 97.5])
    return float(low), float(high)


def _within(misfit: Floats, repeat: Ints) -> float | None:
    parts: list[Floats] = []
    dof = 0
    for group in np.unique(repeat[repeat >= 0]):
        mine = misfit[repeat == group]
        if len(mine) > 1:
            parts.append((mine - mine.mean(axis=0)) * np.sqrt(len(mine) / (len(mine) - 1.0)))
            dof += len(mine) - 1
    if dof < FEWEST_DOF:
        return None
    return _rms(np.concatenate(parts))


def near_in_time(misfit: Floats, repeat: Ints, t_s: Floats) -> float | None:
    """Scatter (m) of the nearer half of repeats, of misfit (row, k); None where the farther half disagrees no more.

    Null: the visits of each pose exchanged in time.
    """
    groups = [np.flatnonzero(repeat == group) for group in np.unique(repeat[repeat >= 0])]
    groups = [mine for mine in groups if len(mine) > 1]
    a, b = (np.concatenate([mine[np.triu_indices(len(mine), 1)[i]] for mine in groups]) for i in (0, 1))
    gap_s = np.abs(t_s[a] - t_s[b])
    far = gap_s > np.median(gap_s)
    if not far.any() or np.sum(~far) * misfit.shape[1] < FEWEST_DOF:
        return None

    def squares(values: Floats) -> tuple[float, float]:
        square = np.mean((values[a] - values[b]) ** 2, axis=1) / 2.0
        return float(np.mean(square[~far])), float(np.mean(square[far]))

    near, away = squares(misfit)
    rng, above, moved = np.random.default_rng(1), 0, misfit.copy()
    for _ in range(EXCHANGES):
        for mine in groups:
            moved[mine] = misfit[rng.permutation(mine)]
        one, other = squares(moved)
        above += other * near >= away * one
    return float(np.sqrt(near)) if above < BY_CHANCE * EXCHANGES else None


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")
