"""Which samples a proof leaves out: at random, each place in turn, the end of the session. Repeats stay together."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.fit.held_out import Split, by_place, last_block
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import point_of

Ints = NDArray[np.intp]

SHARE = 0.2  # of the samples
MOST = 3  # places that are left out in turn, the largest ones: each costs two refits
FOLDS = 5  # of blocks in time
BLOCKS = 10  # in time, of each fold
IN_A_BLOCK = 3  # samples, in a small session: single ones would be half seen by their neighbours
HALVINGS = 3  # of the workspace
REGIONS = 2**HALVINGS
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


def blocks(drivers: Drivers) -> Ints:
    """(sample,) number of its block in time, as many in each fold; visits of one pose are where its first one is."""
    rank = np.argsort(np.argsort(drivers.t_s, kind="stable"))
    _, label = np.unique(units(drivers), return_inverse=True)
    first, count = np.full(len(rank), len(rank)), FOLDS * min(max(len(rank) // (FOLDS * IN_A_BLOCK), 1), BLOCKS)
    np.minimum.at(first, label, rank)
    return np.asarray(first[label] * count // max(len(rank), 1))


def regions(drivers: Drivers) -> Ints:
    """(sample,) number of its region of the workspace, which is halved where the flange goes furthest."""
    _, first, label = np.unique(units(drivers), return_index=True, return_inverse=True)
    place_m, region = point_of(drivers, drivers.n_joints, (0.0, 0.0, 0.0))[first], np.zeros(len(first), dtype=np.intp)
    for _ in range(HALVINGS):
        for mine in [np.flatnonzero(region == number) for number in np.unique(region)]:
            along = place_m[mine][:, np.argmax(np.ptp(place_m[mine], axis=0))]
            halved = mine[np.argsort(along, kind="stable")]
            region[halved] = 2 * region[halved] + (2 * np.arange(len(mine)) >= len(mine))
    return region[label]


def _at_random(drivers: Drivers, samples: Ints, rng: Generator) -> tuple[Ints, ...]:
    """A share of the samples; of a small session several in turn, until there are enough for a proof."""
    labels = units(drivers)[samples]
    names = rng.permutation(np.unique(labels))
    some = max(1, round(SHARE * len(names)))
    out: list[Ints] = []
    while len(out) * some < len(names) and sum(map(len, out)) < FEWEST:
        out.append(samples[np.isin(labels, names[len(out) * some :][:some])])
    return tuple(out)
