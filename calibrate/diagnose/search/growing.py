"""The next term: the best one that is significant, of a size that a machine could have, and confirmed by a refit."""

from dataclasses import replace
from itertools import islice

import numpy as np

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.null import Null, is_slow
from calibrate.diagnose.search.proposals import Proposal, proposals
from calibrate.diagnose.search.score import Removed, Scores, orthonormal
from calibrate.diagnose.search.searching import (
    ALPHA_DRIFT,
    ALPHA_FIRST,
    ALPHA_FURTHER,
    FEW_DRAWS,
    SURE,
    SURE_SLOW,
    Key,
    Search,
    cause_of,
    null_at,
)
from calibrate.diagnose.state.visible import VISIBLE
from calibrate.model.effects.term import Accepted, Term

AT_ONCE = 4  # sure ones that are accepted before a refit
PEERS = 8  # physics at a port that are looked at in turn for a plausible entry: ten thermometers are one growth
LOOKED_AT = 32  # best entries, in all
REFUSED = 6  # refits in a row that confirm no entry: nothing further can be told apart


def admissible(
    bench: Bench, found: Scores, without: Removed | None, least: float, barred: frozenset[Key]
) -> Proposal | None:
    """The best proposal above a gain that is not barred and of a size that a machine could have."""
    refused: set[tuple[str, str]] = set()
    for proposal in islice(proposals(bench, found, without, least, barred), LOOKED_AT):
        accepted = proposal.accepted
        if accepted.term.plausible(accepted.coefficients, accepted.inner, bench.noise_rad):
            return proposal
        refused.add((accepted.term.port.where, accepted.term.physics))
        if len(refused) == PEERS:
            break
    return None


def grown(at: Search) -> Search | None:
    """With the best term that is significant and that a refit confirms; None if there is none."""
    barred = at.causes | at.banned
    null: Null | None = None
    slow = at.bench.menu.of_terms(np.array([is_slow(t) for t in at.bench.menu.terms], dtype=bool))
    out = np.zeros(len(slow), dtype=bool)
    refused = 0
    while refused < REFUSED:
        found = replace(at.bench.scores, gain=np.where(out, -np.inf, at.bench.scores.gain))
        proposed = admissible(at.bench, found, None, 0.0, barred)
        if proposed is None:
            return None
        entry, coarse = proposed.entry, float(found.gain[proposed.entry])  # the null knows the grid, no finer values
        p = 0.0
        if coarse < _sure(proposed.term):
            null = null_at(at.bench, at.rng, FEW_DRAWS) if null is None else null
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
    span = orthonormal(columns, VISIBLE).T
    return null.p(bench.sight, is_slow(own.term), coarse, span, len(span) + len(own.inner))


def _alpha(at: Search, null: Null | None, slow: bool) -> float:
    """Where noise wanders, a drift has the whole 5 %: the null overstates the wander, and false drifts are rarer."""
    if at.state.accepted:
        return ALPHA_FURTHER
    return ALPHA_DRIFT if slow and null is not None and null.law.wanders else ALPHA_FIRST


def _sure(term: Term) -> float:
    return SURE_SLOW if is_slow(term) else SURE


def _sure_ones(at: Search, first: Accepted, barred: frozenset[Key]) -> list[Accepted]:
    """The first, and what is certain beside it: one refit for several clear effects."""
    out, bench = [first], at.bench
    while len(out) < AT_ONCE:
        bench = bench.with_taken(out[-1])
        barred = barred | {cause_of(out[-1].term)}
        proposed = admissible(bench, bench.scores, None, SURE_SLOW, barred)
        if proposed is None:
            break
        out.append(proposed.accepted)
    return out
