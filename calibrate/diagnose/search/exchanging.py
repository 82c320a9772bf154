"""Terms exchanged for better ones: each in turn for any other, and groups of surrogates for the one behind them."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.growing import admissible
from calibrate.diagnose.search.null import is_slow
from calibrate.diagnose.search.pruning import balances
from calibrate.diagnose.search.score import gain_of, removed, scores
from calibrate.diagnose.search.searching import (
    BETTER,
    Key,
    Search,
    taken,
)
from calibrate.model.effects.term import Accepted

Group = tuple[int, ...]

SWAPS = 12  # in a row
PAIRED = 8  # terms: up to so many, every pair is tried as one


def swapped(at: Search) -> Search:
    """Every chosen term tried against all others, the most promising exchange first."""
    refused: frozenset[tuple[Key, Key]] = frozenset()
    for _ in range(SWAPS):
        best: tuple[float, int, Accepted] | None = None
        for i, gone in enumerate(at.bench.gone):
            own = at.state.accepted[i].term.key
            worth = gain_of(gone, at.bench.sight)
            barred = taken(at.bench, (i,)) | {new for old, new in refused if old == own} | {own}
            least = max(worth + BETTER, best[0] + worth if best else -np.inf)
            found = scores(at.bench.menu, gone)
            proposed = admissible(at.bench, found, gone, least, barred)
            if proposed is not None:
                best = (proposed.gain - worth, i, proposed.accepted)
        if best is None:
            return at
        _, i, proposed = best
        old = at.state.accepted[i].term.key
        bench = Bench(at.state.refitted([proposed if j == i else a for j, a in enumerate(at.state.accepted)]))
        if bench.bic < at.bench.bic - BETTER and bench.plausible[i] and not balances(bench, at.bench):
            p = {k: v for k, v in at.p.items() if k != old} | {proposed.term.key: at.p.get(old, 0.0)}
            at = replace(at.at(bench), p=p)
        else:
            refused = refused | {(old, proposed.term.key)}
    return at


def merged(at: Search) -> Search:
    """Several terms exchanged for one: surrogates share a port, a driver or a lever, and none of them can go alone."""
    refused: frozenset[tuple[Group, Key]] = frozenset()
    for _ in range(SWAPS):
        best: tuple[float, Group, Accepted] | None = None
        for group in _groups(at):
            gone = removed(at.state, at.bench.sight, group)
            worth = gain_of(gone, at.bench.sight)
            barred = taken(at.bench, group) | {new for old, new in refused if old == group}
            found = scores(at.bench.menu, gone)
            least = max(worth + BETTER, best[0] + worth if best else -np.inf)
            proposed = admissible(at.bench, found, gone, least, barred)
            if proposed is not None:
                best = (proposed.gain - worth, group, proposed.accepted)
        if best is None:
            return at
        _, group, proposed = best
        kept = [a for j, a in enumerate(at.state.accepted) if j not in group]
        bench = Bench(at.state.refitted([*kept, proposed]))
        if bench.bic < at.bench.bic - BETTER and bench.plausible[-1]:
            p = {a.term.key: at.p.get(a.term.key, 0.0) for a in kept} | {proposed.term.key: 0.0}
            return swapped(replace(at.at(bench), p=p))
        refused = refused | {(group, proposed.term.key)}
    return at


def _groups(at: Search) -> list[Group]:
    """Accepted terms that one other might stand for: of a port, of a driver or one kind of it (many that change with
    time are one warm-up, many bends one soft joint), of a physics; and all pairs of few.
    """
    terms = [a.term for a in at.state.accepted]
    found: set[Group] = set()
    kinds = ["t" if is_slow(t) else t.depends_on[0].rstrip("0123456789") for t in terms]
    for labels in ([t.port.where for t in terms], [t.depends_on for t in terms], kinds, [t.physics for t in terms]):
        found |= {tuple(i for i, other in enumerate(labels) if other == label) for label in labels}
    if len(terms) <= PAIRED:
        found |= set(combinations(range(len(terms)), 2)) | {tuple(range(len(terms)))}
    return sorted(group for group in found if len(group) > 1)
