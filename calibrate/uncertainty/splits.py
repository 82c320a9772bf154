"""Which rows a proof leaves out: at random, a place at a time, or the end of the session."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Split:
    """Folds of unseen rows; each is predicted from all rows that are not in it."""

    says: str
    unseen: tuple[Rows, ...]


def at_random(rows: int, rng: Generator, share: float = 0.2) -> Split:
    """One fold of this share of the rows: how well is a pose among those measured predicted."""
    chosen = rng.permutation(rows)[: max(1, round(share * rows))]
    return Split(f"random {share:.0%} of the rows", (np.sort(chosen),))


def by_place(place: NDArray[np.int64]) -> Split:
    """A fold for each placement, seat or place of the device, `place` (row,): what stands elsewhere is predicted."""
    places = np.unique(place)
    return Split(f"each of {len(places)} places in turn", tuple(np.flatnonzero(place == p) for p in places))


def last_block(t_s: NDArray[np.float64], share: float = 0.2) -> Split:
    """The last share of the session in time, `t_s` (row,): has anything drifted."""
    order = np.argsort(t_s, kind="stable")
    last = order[len(order) - max(1, round(share * len(order))) :]
    return Split(f"last {share:.0%} of the session", (np.sort(last),))


def usual(
    rows: int, rng: Generator, *, place: NDArray[np.int64] | None = None, t_s: NDArray[np.float64] | None = None
) -> tuple[Split, ...]:
    """What every result is proved by: a random fifth, each place if there are several, and the last fifth in time."""
    splits = [at_random(rows, rng)]
    if place is not None and len(np.unique(place)) > 1:
        splits.append(by_place(place))
    if t_s is not None:
        splits.append(last_block(t_s))
    return tuple(splits)
