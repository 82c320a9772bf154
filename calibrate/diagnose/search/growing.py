"""The next term: the best one that is significant, of a size that a machine could have, and confirmed by a refit.

Candidates in the order of what they would explain with their inner values at their best.

A grid of times or constants hides much of a candidate's worth once the noise of a model is small: compared by grids, a
step that falls between two of them would never be the alternative of another step.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from calibrate.diagnose import limits as shared_limits
from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined, solved
from calibrate.diagnose.search.null import Null, is_slow
from calibrate.diagnose.search.score import Removed, Scores, bic_gain, orthonormal
from calibrate.diagnose.search.searching import Key, Search, cause_of, null_at
from calibrate.model.effects.term import Accepted, Term


@dataclass(frozen=True, eq=False)
class Proposal:
    """One candidate, everything else linearly refitted."""

    accepted: Accepted
    entry: int  # of the menu: the best on the grid
    gain: float  # of BIC

    @property
    def term(self) -> Term:
        return self.accepted.term


def proposals(
    bench: Bench, found: Scores, without: Removed | None, least: float, barred: frozenset[Key]
) -> Iterator[Proposal]:
    """One of each key that is not barred, itself or by its cause, and gains more than `least`; the best first."""
    coarse = _best_entries(bench, found, barred)
    worth = limits.WORTH_REFINING * max(least, float(found.gain[coarse[0]]) if coarse else 0.0)
    inner = [e for e in coarse if bench.menu.entries[e].inner.size and found.gain[e] > worth][: limits.REFINED]
    ready = {entry: _proposal(bench, found, without, entry) for entry in inner}
    gains = {entry: ready[entry].gain if entry in ready else float(found.gain[entry]) for entry in coarse}
    for entry in sorted(coarse, key=lambda e: -round(gains[e], limits.EQUAL_DECIMALS)):
        if gains[entry] <= least:
            return
        yield ready[entry] if entry in ready else _proposal(bench, found, without, entry)


def _best_entries(bench: Bench, found: Scores, barred: frozenset[Key]) -> list[int]:
    """The best entry of every key, best first; of equal ones the first of the catalogue."""
    out: dict[Key, int] = {}
    for entry in np.argsort(-np.round(found.gain, limits.EQUAL_DECIMALS), kind="stable"):
        if found.gain[entry] <= 0.0:
            break
        term = bench.menu.terms[bench.menu.entries[entry].term]
        if term.key not in barred and cause_of(term) not in barred:
            out.setdefault(term.key, int(entry))
    return list(out.values())


def _proposal(bench: Bench, found: Scores, without: Removed | None, entry: int) -> Proposal:
    chosen = bench.menu.entries[entry]
    term = bench.menu.terms[chosen.term]
    if not chosen.inner.size:
        values, _ = solved(bench, term, chosen.inner, without)
        return Proposal(Accepted(term, values, chosen.inner), entry, float(found.gain[entry]))
    accepted = refined(bench, term, chosen.inner, without)
    squares = solved(bench, term, accepted.inner, without)[1]
    rss = bench.sight.rss + (without.squares if without is not None else 0.0)
    numbers = int(found.rank[entry]) + chosen.inner.size
    gain = float(bic_gain(np.array(squares), rss, np.array(numbers), bench.sight.data))
    return Proposal(accepted, entry, max(gain, float(found.gain[entry])))


def admissible(
    bench: Bench, found: Scores, without: Removed | None, least: float, barred: frozenset[Key]
) -> Proposal | None:
    """The best proposal above a gain that is not barred and of a size that a machine could have."""
    refused: set[tuple[str, str]] = set()
    for proposal in islice(proposals(bench, found, without, least, barred), limits.LOOKED_AT):
        accepted = proposal.accepted
        if accepted.term.plausible(accepted.coefficients, accepted.inner, bench.noise_rad):
            return proposal
        refused.add((accepted.term.port.where, accepted.term.physics))
        if len(refused) == limits.PEERS:
            break
    return None


def grown(at: Search) -> Search | None:
    """With the best term that is significant and that a refit confirms; None if there is none."""
    barred = at.causes | at.banned
    null: Null | None = None
    slow = at.bench.menu.of_terms(np.array([is_slow(t) for t in at.bench.menu.terms], dtype=bool))
    out = np.zeros(len(slow), dtype=bool)
    refused = 0
    while refused < limits.REFUSED:
        found = replace(at.bench.scores, gain=np.where(out, -np.inf, at.bench.scores.gain))
        proposed = admissible(at.bench, found, None, 0.0, barred)
        if proposed is None:
            return None
        entry, coarse = proposed.entry, float(found.gain[proposed.entry])  # the null knows the grid, no finer values
        p = 0.0
        if coarse < _sure(proposed.term):
            null = null_at(at.bench, at.rng, limits.FEW_NULL_DRAWS) if null is None else null
            p = _p_of(at.bench, proposed, null, coarse)
        if p > _alpha(at, null, bool(slow[entry])):
            # The other family has its own null: a wander that hides a drift need not hide a harmonic.
            out |= slow if slow[entry] else ~slow
            continue
        sure = coarse >= _sure(proposed.term)
        new = _sure_ones(at, proposed.accepted, barred) if sure else [proposed.accepted]
        bench = Bench(at.state.refitted((*at.state.accepted, *new)))
        if bench.bic < at.bench.bic and bench.plausible[-len(new) :].all():
            return replace(at.at(bench), p=at.p | {a.term.key: p for a in new})
        barred, refused = barred | {proposed.term.key}, refused + 1
    return None


def _p_of(bench: Bench, proposed: Proposal, null: Null, coarse: float) -> float:
    own = proposed.accepted
    columns = bench.sight.complement(bench.state.columns(own.term, own.inner).T).T
    span = orthonormal(columns, shared_limits.VISIBLE).T
    return null.p(bench.sight, is_slow(own.term), coarse, span, len(span) + len(own.inner))


def _alpha(at: Search, null: Null | None, slow: bool) -> float:
    """Where noise wanders, a drift enters at a wider level, since the null overstates the wander; `confirmed` asks it
    for the usual level in the end.
    """
    if at.state.accepted:
        return limits.ALPHA_FURTHER
    return limits.ALPHA_DRIFT if slow and null is not None and null.law.wanders else limits.ALPHA_FIRST


def _sure(term: Term) -> float:
    return limits.SURE_SLOW if is_slow(term) else limits.SURE


def _sure_ones(at: Search, first: Accepted, barred: frozenset[Key]) -> list[Accepted]:
    """The first, and what is certain beside it: one refit for several clear effects."""
    out, bench = [first], at.bench
    while len(out) < limits.AT_ONCE:
        bench = bench.with_taken(out[-1])
        barred = barred | {cause_of(out[-1].term)}
        proposed = admissible(bench, bench.scores, None, limits.SURE_SLOW, barred)
        if proposed is None:
            break
        out.append(proposed.accepted)
    return out
