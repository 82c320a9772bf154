"""Which samples a proof leaves out: at random, each place in turn, the end of the session. Repeats stay together."""

from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.effects.drivers import Drivers
from calibrate.uncertainty.splits import Split, by_place, last_block

Ints = NDArray[np.intp]

SHARE = 0.2  # of the samples
MOST = 3  # places that are left out in turn, the largest ones: each costs two refits
FEWEST = 10  # samples of a place, and of anything that is left out


def splits_of(drivers: Drivers, samples: Ints, rng: Generator) -> tuple[Split, ...]:
    """Those that a session allows."""
    found = [Split("random", _at_random(drivers, samples, rng))]
    place = places(drivers)[samples]
    folds = sorted(by_place(place, FEWEST).unseen, key=len, reverse=True)[:MOST]
    if len(folds) > 1:
        found.append(Split("place", tuple(samples[fold] for fold in folds)))
    found.append(Split("last block", tuple(samples[fold] for fold in last_block(drivers.t_s[samples], SHARE).unseen)))
    return tuple(split for split in found if _proves(split, len(samples)))


def _proves(split: Split, samples: int) -> bool:
    """Whether it leaves enough out, and enough to fit."""
    left_out = [len(fold) for fold in split.unseen]
    return sum(left_out) >= FEWEST and max(left_out) <= samples - FEWEST


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


def k_folds(labels: Ints, k: int, rng: Generator) -> Sequence[Ints]:
    """Indices of `labels` (row,) in k parts, equal labels together."""
    names = rng.permutation(np.unique(labels))
    return [np.flatnonzero(np.isin(labels, part)) for part in np.array_split(names, k)]


def _at_random(drivers: Drivers, samples: Ints, rng: Generator) -> tuple[Ints, ...]:
    """A share of the samples; of a small session several in turn, until there are enough for a proof."""
    labels = units(drivers)[samples]
    names = rng.permutation(np.unique(labels))
    some = max(1, round(SHARE * len(names)))
    out: list[Ints] = []
    while len(out) * some < len(names) and sum(map(len, out)) < FEWEST:
        out.append(samples[np.isin(labels, names[len(out) * some :][:some])])
    return tuple(out)
