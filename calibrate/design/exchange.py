"""Choosing poses: the criterion of a good set, and the exchange that finds one.

A criterion is a loss of an information matrix, smaller is better, with what each candidate would save. A new criterion
is one entry of CRITERIA. Poses are chosen one after the other, then exchanged until no exchange is better.

Sources: the error at the poses that matter (test-pose criterion): Klimchik, Caro, Wu, Pashkevich, ICRA 2014;
D-optimality with priors: Chaloner, Verdinelli, Statistical Science 10(3), 1995, section 2; O1 to O5:
fit/rank/observability.py; exchange: Fedorov, Theory of optimal experiments, 1972, ch. 3; Mitchell, Technometrics
16(2), 1974 (DETMAX: out with the least useful, in with the best).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.design.information import Information

Floats = NDArray[np.float64]

SEEN = 1e-6  # of the largest singular value of all candidates together: what is below, no choice of poses shows
WHISPER = 1e-9  # of the largest eigenvalue: makes the first poses comparable, which alone see not all
SHORT = 24  # candidates whose saving is computed exactly, by first order the most promising


class Criterion(Protocol):
    """Over information matrices A (param, param)."""

    def start(self) -> Floats:
        """(param, param) before any pose."""
        ...

    def loss(self, A: Floats) -> float: ...

    def savings(self, A: Floats) -> Floats:
        """(pose,) by how much each candidate makes the loss smaller; -inf where it need not be looked at."""
        ...

    def without(self, A: Floats, pose: int) -> Floats:
        """The information less that of one candidate."""
        ...

    def with_(self, A: Floats, pose: int) -> Floats:
        """The information and that of one candidate."""
        ...


@dataclass(frozen=True)
class _Rows:
    """Candidates' rows (pose, k, param) and what adding and taking away does."""

    rows: Floats
    first: Floats

    def start(self) -> Floats:
        return self.first

    def with_(self, A: Floats, pose: int) -> Floats:
        return A + self.rows[pose].T @ self.rows[pose]

    def without(self, A: Floats, pose: int) -> Floats:
        return A - self.rows[pose].T @ self.rows[pose]


@dataclass(frozen=True)
class WorkspaceError(_Rows):
    """Mean square error of the target over the workspace, m^2."""

    weight: Floats

    def loss(self, A: Floats) -> float:
        return float(np.trace(np.linalg.solve(A, self.weight)))

    def savings(self, A: Floats) -> Floats:
        """Exact: tr((1 + X C X')^-1 X C W C X'), Woodbury's identity."""
        C = np.linalg.inv(A)
        XC = self.rows @ C
        inner = XC @ np.swapaxes(self.rows, 1, 2) + np.eye(self.rows.shape[1])
        outer = XC @ self.weight @ np.swapaxes(XC, 1, 2)
        return np.trace(np.linalg.solve(inner, outer), axis1=1, axis2=2)


@dataclass(frozen=True)
class Determinant(_Rows):
    """Minus the logarithm of the determinant."""

    def loss(self, A: Floats) -> float:
        return -float(np.linalg.slogdet(A)[1])

    def savings(self, A: Floats) -> Floats:
        """Exact: ln det(1 + X C X')."""
        inner = self.rows @ np.linalg.inv(A) @ np.swapaxes(self.rows, 1, 2) + np.eye(self.rows.shape[1])
        return np.linalg.slogdet(inner)[1]


@dataclass(frozen=True)
class Index(_Rows):
    """Minus an index of the singular values, falling, of what the candidates can show at all; data alone."""

    of: Callable[[Floats], float]

    def loss(self, A: Floats) -> float:
        return -self.of(np.sqrt(np.maximum(np.linalg.eigvalsh(A)[::-1], 0.0)))

    def savings(self, A: Floats) -> Floats:
        """Exact for the most promising: those with most along the least seen directions."""
        values, vectors = np.linalg.eigh(A)
        along = (self.rows @ vectors) / np.sqrt(values)
        short = np.argsort(-np.sum(np.log1p(np.sum(along**2, axis=1)), axis=1))[:SHORT]
        weak = np.argsort(-np.sum(along[:, :, 0] ** 2, axis=1))[:SHORT]
        out, now = np.full(len(self.rows), -np.inf), self.loss(A)
        for pose in np.union1d(short, weak):
            out[pose] = now - self.loss(self.with_(A, int(pose)))
        return out


def _free_space(found: Information) -> Criterion:
    return WorkspaceError(found.rows, found.before, found.target_weight)


def _determinant(found: Information) -> Criterion:
    return Determinant(found.rows, found.before)


def _index(of: Callable[[Floats], float]) -> Callable[[Information], Criterion]:
    def build(found: Information) -> Criterion:
        _, s, Vt = np.linalg.svd(found.rows.reshape(-1, found.n), full_matrices=False)
        rows = found.rows @ Vt[s > SEEN * s[0]].T
        return Index(rows, WHISPER * s[0] ** 2 * np.eye(rows.shape[2]), of)

    return build


CRITERIA: Mapping[str, Callable[[Information], Criterion]] = {
    "free-space": _free_space,
    "d": _determinant,
    "o1": _index(lambda s: float(np.exp(np.mean(np.log(np.maximum(s, 1e-300)))))),
    "o2": _index(lambda s: float(s[-1] / s[0])),
    "o3": _index(lambda s: float(s[-1])),
    "o4": _index(lambda s: float(s[-1] ** 2 / s[0])),
    "o5": _index(lambda s: float(1.0 / np.sum(1.0 / np.maximum(s, 1e-300)))),
}


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
        chosen, loss = exchange(criterion, start)
        if best is None or loss < best.loss:
            best = Choice(np.array(chosen, dtype=np.intp), losses, loss)
        progress(done + 1, len(starts))
    if best is None:
        raise ValueError("no start: give candidates")
    return best


def exchange(criterion: Criterion, start: Sequence[int]) -> tuple[list[int], float]:
    """Poses and their loss, when a round makes no exchange."""
    chosen = list(start)
    known = criterion.start()
    for pose in chosen:
        known = criterion.with_(known, pose)
    now = criterion.loss(known)
    for _ in range(ROUNDS):
        changed = False
        for pose in _least_useful(criterion, known, chosen):
            less = criterion.without(known, pose)
            savings = criterion.savings(less)
            savings[[other for other in chosen if other != pose]] = -np.inf
            best = int(np.argmax(savings))
            new = criterion.with_(less, best)
            loss = criterion.loss(new)
            if best != pose and loss < now - BETTER * abs(now):
                chosen[chosen.index(pose)] = best
                known, now, changed = new, loss, True
        if not changed:
            break
    return chosen, now


def _least_useful(criterion: Criterion, A: Floats, chosen: list[int]) -> list[int]:
    """All of them, that first whose loss is missed least."""
    lost = [criterion.loss(criterion.without(A, pose)) for pose in chosen]
    return [chosen[i] for i in np.argsort(lost)]
