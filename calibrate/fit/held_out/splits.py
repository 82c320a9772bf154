"""Which rows a proof leaves out: at random, a place at a time, or the end of the session.

Rows of one pose stay together: a pose that was visited before is not unseen.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial import KDTree

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

CLOSE_RAD = 0.01  # rows whose joints are nearer than this to those of a pose are of it


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


def same_poses(q_rad: Floats) -> Rows:
    """(row,) number from 0 of the pose of each row of joints (row, joint), in the order in which they first come."""
    out, poses = np.full(len(q_rad), -1, dtype=np.intp), 0
    known = np.all(np.isfinite(q_rad), axis=1)
    at, tree = np.flatnonzero(known), KDTree(q_rad[known])
    for row in range(len(q_rad)):
        if out[row] < 0:
            near = at[tree.query_ball_point(q_rad[row], CLOSE_RAD, p=np.inf)] if known[row] else np.array([row])
            out[near[out[near] < 0]] = poses
            poses += 1
    return out


def at_random(rows: int, rng: Generator, share: float = 0.2, pose: Rows | None = None) -> Split:
    """One fold of this share of the rows: how well is a pose among those measured predicted. `pose` (row,): numbers."""
    poses, its, rows_of = np.unique(np.arange(rows) if pose is None else pose, return_inverse=True, return_counts=True)
    order = rng.permutation(len(poses))
    count = 1 + np.searchsorted(np.cumsum(rows_of[order]), max(1, round(share * rows)))
    return Split(f"random {share:.0%} of the rows", (np.flatnonzero(np.isin(its, order[:count])),))


def by_place(place: NDArray[np.int64] | Rows, fewest: int = 1) -> Split:
    """A fold for each placement, seat or place of the device, `place` (row,): what stands elsewhere is predicted.

    Rows of a place below 0 have none and are never left out; nor are those of a place with less than `fewest`.
    """
    folds = tuple(np.flatnonzero(place == p) for p in np.unique(place[place >= 0]))
    folds = tuple(fold for fold in folds if len(fold) >= fewest)
    return Split(f"each of {len(folds)} places in turn", folds)


def last_block(t_s: Floats, share: float = 0.2, pose: Rows | None = None) -> Split:
    """The last share of the session in time, `t_s` (row,): has anything drifted. A pose is where it first came."""
    its = np.arange(len(t_s)) if pose is None else np.unique(pose, return_inverse=True)[1]
    first_s = np.full(its.max(initial=-1) + 1, np.inf)
    np.minimum.at(first_s, its, t_s)
    order = np.argsort(first_s[its], kind="stable")
    last = order[len(order) - max(1, round(share * len(order))) :]
    return Split(f"last {share:.0%} of the session", (np.flatnonzero(np.isin(its, its[last])),))


def usual(
    rows: int,
    rng: Generator,
    *,
    place: NDArray[np.int64] | None = None,
    t_s: Floats | None = None,
    pose: Rows | None = None,
    share: float = 0.2,
    kinds: tuple[SplitKind, ...] = tuple(SplitKind),
) -> tuple[Split, ...]:
    """What every result is proved by: a random fifth, each place if there are several, and the last fifth in time."""
    splits = [at_random(rows, rng, share, pose)] if SplitKind.RANDOM in kinds else []
    if SplitKind.PLACE in kinds and place is not None and len(np.unique(place[place >= 0])) > 1:
        splits.append(by_place(place))
    if SplitKind.LAST in kinds and t_s is not None and len(np.unique(t_s)) > 1:
        splits.append(last_block(t_s, share, pose))
    return tuple(splits)
