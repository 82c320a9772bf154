"""Terms that have to go: not worth their cost, replaced or balanced by others, gone at the same pose, or mere noise.

Whether a slow term holds where the arm came back to a pose: geometry cannot change there, but time has gone by.
A drift that geometry has half absorbed resembles one; between two visits of one pose geometry is the same, so what
changed there is the drift alone, or there was none (mismatch catalogue, false alarms).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.null import Null, is_slow
from calibrate.diagnose.search.score import gain_of
from calibrate.diagnose.search.searching import Search, null_at

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


def tidied(at: Search) -> Search:
    """Backward: without terms that cost more than they are worth, or that the others can nearly replace."""
    while at.state.accepted:
        worth = np.array([gain_of(gone, at.bench.sight) for gone in at.bench.gone])
        allowed = np.where(at.bench.share < limits.COLLINEAR, limits.COLLINEAR_COST, 0.0)
        over = np.where(at.bench.plausible, worth - allowed, -np.inf)
        for i in (*surrogates(at.bench), *fading(at.bench)):
            over[i] = min(over[i], -1.0)
        worst = int(np.argmin(over))
        if over[worst] > 0.0:
            return at
        at = without(at, worst)
    return at


def surrogates(bench: Bench) -> list[int]:
    """Of every port whose terms all but cancel each other, the one that is worth least: no machine balances itself."""
    return [min(mine, key=lambda i: bench.gone[i].squares) for mine in balanced(bench).values()]


def balanced(bench: Bench) -> dict[str, list[int]]:
    """Accepted terms by port, where they all but cancel each other."""
    accepted = bench.state.accepted
    felt = np.stack([bench.behind(a) for a in accepted])
    ports = {a.term.port.where for a in accepted}
    mine = {where: [i for i, a in enumerate(accepted) if a.term.port.where == where] for where in sorted(ports)}
    return {
        where: at
        for where, at in mine.items()
        if len(at) > 1 and np.sum(felt[at].sum(axis=0) ** 2) < limits.CANCELS * np.sum(felt[at] ** 2)
    }


def balances(new: Bench, old: Bench) -> bool:
    """Whether terms of a port all but cancel each other that did not before: pruning would take one away again."""
    return not balanced(new).keys() <= balanced(old).keys()


def without(at: Search, i: int) -> Search:
    """Refitted without one accepted term, which is banned until the model is another."""
    kept = [a for j, a in enumerate(at.state.accepted) if j != i]
    gone = at.state.accepted[i].term.key
    bench = Bench(at.state.refitted(kept))
    return replace(at, bench=bench, banned=at.banned | {gone}, p={k: v for k, v in at.p.items() if k != gone})


def confirmed(at: Search) -> Search:
    """Each term against the null of the final residual; the least significant one goes first.

    One null for all: what goes would be taken for noise that wanders in the next one, and take others with it. What is
    usual has a level of its own, nobody had to search for it; it has to be worth something, too.
    """
    null = null_at(at.bench, at.rng) if at.state.accepted else None
    while null is not None and at.state.accepted:
        p = {a.term.key: p_of(at.bench, null, i) for i, a in enumerate(at.state.accepted)}
        at = replace(at, p=p)
        usual = np.array([a.term.key in at.usual for a in at.state.accepted])
        alpha = np.where(usual, limits.ALPHA_USUAL, limits.ALPHA_FURTHER if len(usual) > 1 else limits.ALPHA_FIRST)
        values = np.array([p[a.term.key] for a in at.state.accepted]) / alpha
        worth = np.array([gain_of(gone, at.bench.sight) for gone in at.bench.gone])
        values[usual & (worth < limits.USUAL_WORTH)] = np.inf
        worst = int(np.argmax(values))
        if values[worst] <= 1.0:
            return at
        at = without(at, worst)
    return at


def p_of(bench: Bench, null: Null, i: int) -> float:
    """Family-wise probability of an accepted term's worth if there were nothing."""
    gone, term = bench.gone[i], bench.state.accepted[i].term
    return null.p_of_worth(is_slow(term), bench.sight, gone)


def fading(bench: Bench) -> list[int]:
    """Accepted slow terms of which less than half is seen between visits of one pose."""
    slow = [i for i, a in enumerate(bench.state.accepted) if is_slow(a.term)]
    if not slow:
        return []
    trusting = Bench(bench.state.trusting())  # robust weights take out just those rows that speak against the term
    visits = _visits(trusting)
    return [i for i in slow if _fades(trusting, i, visits)]


def _fades(bench: Bench, i: int, visits: Ints) -> bool:
    amount = bench.contribution(bench.state.accepted[i])
    moved = _between(amount, visits)
    shown = float(np.linalg.norm(moved))
    if shown < limits.REVISIT_SIGMAS:
        return False
    seen = float(moved @ _between(amount + bench.state.rows.residual, visits)) / shown**2
    return seen + limits.REVISIT_CONFIDENCE / shown < limits.REVISIT_SHARE


def _visits(bench: Bench) -> Ints:
    """(row,) a number for each component of each repeated pose; -1 elsewhere."""
    rows, repeat = bench.state.rows, bench.state.drivers.repeat
    out = np.full(len(rows.residual), -1)
    if repeat is None:
        return out
    at = np.flatnonzero(rows.data)
    first = np.flatnonzero(np.diff(rows.group[at], prepend=-1))
    component = np.arange(len(at)) - np.repeat(first, np.diff(first, append=len(at)))
    label = np.stack([rows.instrument[at], repeat[rows.sample[at]], component])
    again = label[1] >= 0
    out[at[again]] = np.unique(label[:, again], axis=1, return_inverse=True)[1].ravel()
    return out


def _between(values: Floats, visits: Ints) -> Floats:
    """Of values (row,) what differs from the mean over the visits of the same pose."""
    met, v = visits[visits >= 0], values[visits >= 0]
    return v - (np.bincount(met, v) / np.maximum(np.bincount(met), 1))[met]
