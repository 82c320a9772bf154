"""The proof: geometry alone against geometry and terms on samples that neither has seen, both refitted without them.

Interval by a paired bootstrap over samples: Efron, Tibshirani, An Introduction to the Bootstrap, 1993, ch. 8.

Which samples a proof leaves out: at random, each place in turn, the end of the session. Repeats stay together.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.assess import limits
from calibrate.diagnose.state.linearised import State, UnseenMisfits, tame
from calibrate.errors import DataError
from calibrate.fit.held_out import Split, by_place, last_block
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import point_of
from calibrate.model.effects.term import Accepted
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

Ints = NDArray[np.intp]


def splits_of(drivers: Drivers, samples: Ints, rng: Generator) -> tuple[Split, ...]:
    """Those that a session allows."""
    found = [Split("random", _at_random(drivers, samples, rng))]
    place = places(drivers)[samples]
    folds = sorted(by_place(place, limits.FEWEST_LEFT_OUT).unseen, key=len, reverse=True)[: limits.PLACES_LEFT_OUT]
    if len(folds) > 1:
        found.append(Split("place", tuple(samples[fold] for fold in folds)))
    found.append(
        Split(
            "last block", tuple(samples[fold] for fold in last_block(drivers.t_s[samples], limits.UNSEEN_SHARE).unseen)
        )
    )
    return tuple(split for split in found if _proves(split, len(samples)))


def _proves(split: Split, samples: int) -> bool:
    """Whether it leaves enough out, and enough to fit."""
    left_out = [len(fold) for fold in split.unseen]
    return sum(left_out) >= limits.FEWEST_LEFT_OUT and max(left_out) <= samples - limits.FEWEST_LEFT_OUT


def units(drivers: Drivers) -> Ints:
    """(sample,) samples of one repeated pose share a number."""
    alone = np.arange(len(drivers.t_s))
    if drivers.repeat is None:
        return alone
    return np.where(drivers.repeat >= 0, len(alone) + drivers.repeat, alone).astype(np.intp)


def places(drivers: Drivers) -> Ints:
    """(sample,) place of the fixture, or seat; -1 without any."""
    out = np.full(len(drivers.t_s), -1, dtype=np.intp)
    for offset, readout in enumerate(drivers.readouts.values()):
        if readout.place is not None:
            out = np.where(readout.seen, 1000 * offset + readout.place, out)
    return out


def blocks(drivers: Drivers) -> Ints:
    """(sample,) number of its block in time, as many in each fold; visits of one pose are where its first one is."""
    rank = np.argsort(np.argsort(drivers.t_s, kind="stable"))
    _, label = np.unique(units(drivers), return_inverse=True)
    first, count = (
        np.full(len(rank), len(rank)),
        limits.FOLDS * min(max(len(rank) // (limits.FOLDS * limits.SAMPLES_OF_A_BLOCK), 1), limits.BLOCKS_OF_A_FOLD),
    )
    np.minimum.at(first, label, rank)
    return np.asarray(first[label] * count // max(len(rank), 1))


def regions(drivers: Drivers) -> Ints:
    """(sample,) number of its region of the workspace, which is halved where the flange goes furthest."""
    _, first, label = np.unique(units(drivers), return_index=True, return_inverse=True)
    place_m, region = point_of(drivers, drivers.n_joints, (0.0, 0.0, 0.0))[first], np.zeros(len(first), dtype=np.intp)
    for _ in range(limits.HALVINGS):
        for mine in [np.flatnonzero(region == number) for number in np.unique(region)]:
            along = place_m[mine][:, np.argmax(np.ptp(place_m[mine], axis=0))]
            halved = mine[np.argsort(along, kind="stable")]
            region[halved] = 2 * region[halved] + (2 * np.arange(len(mine)) >= len(mine))
    return region[label]


def _at_random(drivers: Drivers, samples: Ints, rng: Generator) -> tuple[Ints, ...]:
    """A share of the samples; of a small session several in turn, until there are enough for a proof."""
    labels = units(drivers)[samples]
    names = rng.permutation(np.unique(labels))
    some = max(1, round(limits.UNSEEN_SHARE * len(names)))
    out: list[Ints] = []
    while len(out) * some < len(names) and sum(map(len, out)) < limits.FEWEST_LEFT_OUT:
        out.append(samples[np.isin(labels, names[len(out) * some :][:some])])
    return tuple(out)


Floats = NDArray[np.float64]

POSITION = 3  # components of a reading that are lengths


@dataclass(frozen=True)
class HeldOutProof:
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


class Provable(Protocol):
    """What a proof asks of a model; a State has it."""

    @property
    def drivers(self) -> Drivers: ...

    def select(self, samples: Ints) -> Self: ...

    def refitted(self, accepted: Sequence[Accepted]) -> Self: ...

    def held_out(self, samples: Ints) -> tuple[UnseenMisfits, ...]: ...


def proofs(bare: Provable, full: State, samples: Ints, rng: Generator) -> tuple[HeldOutProof, ...]:
    """Every split that the session allows, every instrument; states without and with terms, fitted to all samples.

    DataError where the two predict other observations.
    """
    out: list[HeldOutProof] = []
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


def _proof(bare: Provable, full: State, samples: Ints, split: Split, rng: Generator) -> list[HeldOutProof]:
    before: list[UnseenMisfits] = []
    after: list[UnseenMisfits] = []
    for fold in split.unseen:
        known = np.setdiff1d(samples, fold)
        without = bare.select(known).refitted(()).held_out(fold)
        before += _lengths(without)
        after += _lengths(full.select(known).refitted(full.accepted).held_out(fold) if full.accepted else without)
    names = sorted({u.instrument for u in before})
    return [_compared(split.says, name, before, after, units(bare.drivers), rng) for name in names]


def _lengths(unseen: Sequence[UnseenMisfits]) -> list[UnseenMisfits]:
    """Without second encoders: angles between two readings of a joint are no error of the arm."""
    return [u for u in unseen if u.instrument != ENCODER_DIFFERENCE]


def _compared(
    split: str, name: str, before: Sequence[UnseenMisfits], after: Sequence[UnseenMisfits], labels: Ints, rng: Generator
) -> HeldOutProof:
    if [u.instrument for u in before] != [u.instrument for u in after]:
        raise DataError("the two models predict other instruments")
    mine = [(b, a) for b, a in zip(before, after, strict=True) if b.instrument == name]
    if not all(np.array_equal(b.sample, a.sample) for b, a in mine):
        raise DataError(f"the two models predict other rows of {name}")
    good = np.concatenate([tame(a.whitened, 1.0) for _, a in mine])
    b = np.concatenate([u.misfit[:, :POSITION] for u, _ in mine])[good]
    a = np.concatenate([u.misfit[:, :POSITION] for _, u in mine])[good]
    label = labels[np.concatenate([u.sample for u, _ in mine])[good]]
    squares_b, squares_a = np.sum(b**2, axis=1), np.sum(a**2, axis=1)
    return HeldOutProof(
        split, name, len(b), int(np.sum(~good)), _rms(b), _rms(a), _interval(squares_b, squares_a, label, rng)
    )


def _interval(before: Floats, after: Floats, label: Ints, rng: Generator) -> tuple[float, float]:
    """Of 1 - after / before, samples of one pose drawn together."""
    _, unit = np.unique(label, return_inverse=True)
    b, a = np.bincount(unit, before), np.bincount(unit, after)
    if len(b) < 2:
        return (float("nan"), float("nan"))
    drawn = rng.integers(len(b), size=(limits.BOOTSTRAP_ROUNDS, len(b)))
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
    if dof < limits.NOISE_FLOOR_DOF:
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
    if not far.any() or np.sum(~far) * misfit.shape[1] < limits.NOISE_FLOOR_DOF:
        return None

    def squares(values: Floats) -> tuple[float, float]:
        square = np.mean((values[a] - values[b]) ** 2, axis=1) / 2.0
        return float(np.mean(square[~far])), float(np.mean(square[far]))

    near, away = squares(misfit)
    rng, above, moved = np.random.default_rng(1), 0, misfit.copy()
    for _ in range(limits.FAR_REPEATS_EXCHANGES):
        for mine in groups:
            moved[mine] = misfit[rng.permutation(mine)]
        one, other = squares(moved)
        above += other * near >= away * one
    return float(np.sqrt(near)) if above < limits.FAR_REPEATS_ALPHA * limits.FAR_REPEATS_EXCHANGES else None


def _rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")
