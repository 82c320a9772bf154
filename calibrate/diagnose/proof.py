"""The proof: geometry alone against geometry and terms on samples that neither has seen, both refitted without them.

Interval by a paired bootstrap over samples: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 8.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.folds import splits_of, units
from calibrate.diagnose.linearised import State, Unseen
from calibrate.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.uncertainty.splits import Split

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

ROUNDS = 500
WILD = 6.0  # sigmas after the terms: a wild row, which no model is to blame for
FEWEST_DOF = 20  # of repeats, for a floor
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
    """Of every instrument: robust scatter within repeats after the model, or what the fit leaves."""
    repeat, out = state.drivers.repeat, list[Floor]()
    seen = _lengths(state.held_out(samples))
    total = sum(u.misfit[:, :POSITION].size for u in seen)
    for u in seen:
        good = _tame(u.whitened)
        misfit = u.misfit[:, :POSITION]
        if repeat is not None:
            within = _within(misfit[good], repeat[u.sample[good]])
            if within is not None:
                out.append(Floor(u.instrument, within, "scatter within repeats, after the model"))
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
    tame = np.concatenate([_tame(a.whitened) for _, a in mine])
    b = np.concatenate([u.misfit[:, :POSITION] for u, _ in mine])[tame]
    a = np.concatenate([u.misfit[:, :POSITION] for _, u in mine])[tame]
    label = labels[np.concatenate([u.sample for u, _ in mine])[tame]]
    squares_b, squares_a = np.sum(b**2, axis=1), np.sum(a**2, axis=1)
    return HeldOut(
        split, name, len(b), int(np.sum(~tame)), _rms(b), _rms(a), _interval(squares_b, squares_a, label, rng)
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


def _tame(whitened: Floats) -> NDArray[np.bool_]:
    """Observations that are not wild, by the spread of their own."""
    size = np.max(np.abs(whitened), axis=1)
    middle = float(np.median(np.abs(whitened)) / 0.6745)
    return size <= WILD * max(middle, 1.0)


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


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")
