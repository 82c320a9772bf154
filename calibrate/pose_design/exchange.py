"""Choosing poses: one after the other, then exchanged until no exchange is better.

Sources: Fedorov, Theory of optimal experiments, 1972, ch. 3 (exchange); Mitchell, Technometrics 16(2), 1974 (DETMAX:
out with the least useful, in with the best).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.pose_design.criteria import Criterion

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

BETTER = 1e-4  # of the loss: less is no improvement
ROUNDS = 12  # through all chosen poses; a round without an exchange ends it
DRAWN_STARTS = 2


@dataclass(frozen=True)
class Choice:
    """Candidates in the order of choice; `losses` after each of them, before anything was exchanged."""

    poses: Ints
    losses: Floats  # (count + 1,)
    loss: float  # in the end
    exchanged: int


def one_by_one(criterion: Criterion, count: int, total: int) -> tuple[list[int], Floats]:
    """The first `count` of `total` candidates, each the one that saves most, and the loss after each."""
    known, chosen, open_ = criterion.start(), list[int](), np.ones(total, dtype=bool)
    losses = [criterion.loss(known)]
    for _ in range(min(count, total)):
        best = int(np.argmax(np.where(open_, criterion.savings(known), -np.inf)))
        open_[best] = False
        chosen.append(best)
        known = criterion.with_(known, best)
        losses.append(criterion.loss(known))
    return chosen, np.array(losses)


def choose(
    criterion: Criterion,
    count: int,
    total: int,
    rng: Generator,
    *,
    others: Sequence[Criterion] = (),
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Choice:
    """`count` different candidates of `total`: the best that exchanges reach from several starts.

    Exchanges end in the nearest valley: starts are those chosen one by one, by this criterion and by `others`, and
    drawn ones.
    """
    first, losses = one_by_one(criterion, count, total)
    starts = [first, *(one_by_one(other, count, total)[0] for other in others)]
    starts += [rng.choice(total, min(count, total), replace=False).tolist() for _ in range(DRAWN_STARTS)]
    best: Choice | None = None
    for done, start in enumerate(starts):
        chosen, loss, exchanged = exchange(criterion, start)
        if best is None or loss < best.loss:
            best = Choice(np.array(chosen, dtype=np.intp), losses, loss, exchanged)
        progress(done + 1, len(starts))
    if best is None:
        raise ValueError("no start: give candidates")
    return best


def exchange(criterion: Criterion, start: Sequence[int]) -> tuple[list[int], float, int]:
    """Poses, their loss and the number of exchanges, until a round makes none."""
    chosen, exchanged = list(start), 0
    known = criterion.start()
    for pose in chosen:
        known = criterion.with_(known, pose)
    now = criterion.loss(known)
    for _ in range(ROUNDS):
        changed = 0
        for pose in _least_useful(criterion, known, chosen):
            less = criterion.without(known, pose)
            savings = criterion.savings(less)
            savings[[other for other in chosen if other != pose]] = -np.inf
            best = int(np.argmax(savings))
            new = criterion.with_(less, best)
            loss = criterion.loss(new)
            if best != pose and loss < now - BETTER * abs(now):
                chosen[chosen.index(pose)] = best
                known, now, changed = new, loss, changed + 1
        exchanged += changed
        if changed == 0:
            break
    return chosen, now, exchanged


def _least_useful(criterion: Criterion, A: Floats, chosen: list[int]) -> list[int]:
    """All of them, that first whose loss is missed least."""
    lost = [criterion.loss(criterion.without(A, pose)) for pose in chosen]
    return [chosen[i] for i in np.argsort(lost)]
