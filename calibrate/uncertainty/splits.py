"""Which rows a proof leaves out: at random, a place at a time, or the end of the session."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Rows = NDArray[np.intp]


class SplitKind(Enum):
    """By the word of a fit plan."""

    RANDOM = "random"
    PLACE = "place"
    LAST = "last"


@dataclass(frozen=True)
class Split:
    """Folds of unseen rows; each is predicted from all rows that are not in it."""

    says: str
    unseen: tuple[Rows, ...]


def at_random(rows: int, rng: Generator, share: float = 0.2) -> Split:
    """One fold of this share of the rows: how well is a pose among those measured predicted."""
    chosen = rng.permutation(rows)[: max(1, round(share * rows))]
    return Split(f"random {share:.0%} of the rows", (np.sort(chosen),))


def by_place(place: NDArray[np.int64] | Rows, fewest: int = 1) -> Split:
    """A fold for each placement, seat or place of the device, `place` (row,): what stands elsewhere is predicted.

    Rows of a place below 0 have none and are never left out; nor are those of a place with less than `fewest`.
    """
    folds = tuple(np.flatnonzero(place == p) for p in np.unique(place[place >= 0]))
    folds = tuple(fold for fold in folds if len(fold) >= fewest)
    return Split(f"each of {len(folds)} places in turn", folds)


def last_block(t_s: NDArray[np.float64], share: float = 0.2) -> Split:
    """The last share of the session in time, `t_s` (row,): has anything drifted."""
    order = np.argsort(t_s, kind="stable")
    last = order[len(order) - max(1, round(share * len(order))) :]
    return Split(f"last {share:.0%} of the session", (np.sort(last),))


def usual(
    rows: int,
    rng: Generator,
    *,
    place: NDArray[np.int64] | None = None,
    t_s: NDArray[np.float64] | None = None,
    share: float = 0.2,
    kinds: tuple[SplitKind, ...] = tuple(SplitKind),
) -> tuple[Split, ...]:
    """What every result is proved by: a random fifth, each place if there are several, and the last fifth in time."""
    splits = [at_random(rows, rng, share)] if SplitKind.RANDOM in kinds else []
    if SplitKind.PLACE in kinds and place is not None and len(np.unique(place[place >= 0])) > 1:
        splits.append(by_place(place))
    if SplitKind.LAST in kinds and t_s is not None and len(np.unique(t_s)) > 1:
        splits.append(last_block(t_s, share))
    return tuple(splits)
