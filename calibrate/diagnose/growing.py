"""The next term: the best one that is significant, of a size that a machine could have, and confirmed by a refit."""

from dataclasses import replace

import numpy as np

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.line_search import refined
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.null import Null, is_slow
from calibrate.diagnose.score import Removed, Scores
from calibrate.diagnose.searching import ALPHA_FIRST, ALPHA_FURTHER, SURE, SURE_SLOW, Key, Search, cause_of, null_at
from calibrate.effects.term import Term

AT_ONCE = 4  # sure ones that are accepted before a refit
PEERS = 8  # best entries that are looked at in turn for a plausible one


def admissible(
    bench: Bench, found: Scores, without: Removed | None, least: float, barred: frozenset[Key]
) -> Accepted | None:
    """The best entry above a gain that is not barred and, inner values refined, of a size that a machine could have."""
    seen: set[Key] = set()
    for entry in np.argsort(-found.gain):
        if found.gain[entry] <= least or len(seen) >= PEERS:
            return None
        term = bench.menu.terms[bench.menu.entries[entry].term]
        if term.key in barred or cause_of(term) in barred or term.key in seen:
            continue
        seen.add(term.key)
        proposed = refined(bench, term, bench.menu.entries[entry].inner, without)
        if term.plausible(proposed.coefficients, proposed.inner, bench.noise_rad):
            return proposed
    return None


def grown(at: Search) -> Search | None:
    """With the best term that is significant and that a refit confirms; None if there is none."""
    barred = at.causes | at.banned
    null: Null | None = None
    slow = at.bench.menu.of_terms(np.array([is_slow(t) for t in at.bench.menu.terms], dtype=bool))
    out = np.zeros(len(slow), dtype=bool)
    while True:
        found = replace(at.bench.scores, gain=np.where(out, -np.inf, at.bench.scores.gain))
        proposed = admissible(at.bench, found, None, 0.0, barred)
        if proposed is None:
            return None
        entry = entry_of(at.bench, found, proposed)
        gain = float(found.gain[entry])
        p = 0.0
        if gain < _sure(proposed.term):
            null = null_at(at.bench, at.rng) if null is None else null
            p = null.p(at.bench.menu, entry, gain)
        if p > (ALPHA_FURTHER if at.state.accepted else ALPHA_FIRST):
            # The other family has its own null: a wander that hides a drift need not hide a harmonic.
            out |= slow if slow[entry] else ~slow
            continue
        new = [proposed] if gain < _sure(proposed.term) else _sure_ones(at, proposed, barred)
        bench = Bench(at.state.refitted((*at.state.accepted, *new)))
        if bench.bic < at.bench.bic and bench.plausible[-len(new) :].all():
            return replace(at.at(bench), p=at.p | {a.term.key: p for a in new})
        barred = barred | {proposed.term.key}


def _sure(term: Term) -> float:
    return SURE_SLOW if is_slow(term) else SURE


def _sure_ones(at: Search, first: Accepted, barred: frozenset[Key]) -> list[Accepted]:
    """The first, and what is beyond doubt beside it: one refit for several clear effects."""
    out, bench = [first], at.bench
    while len(out) < AT_ONCE:
        bench = bench.with_taken(out[-1])
        barred = barred | {cause_of(out[-1].term)}
        proposed = admissible(bench, bench.scores, None, SURE_SLOW, barred)
        if proposed is None:
            break
        out.append(proposed)
    return out


def entry_of(bench: Bench, found: Scores, proposed: Accepted) -> int:
    mine = [i for i, e in enumerate(bench.menu.entries) if bench.menu.terms[e.term].key == proposed.term.key]
    return mine[int(np.argmax(found.gain[mine]))]
