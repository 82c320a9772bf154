"""Candidates in the order of what they would explain with their inner values at their best.

A grid of times or constants hides much of a candidate's worth once the noise of a model is small: compared by grids, a
step that falls between two of them would never be the alternative of another step.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined, solved
from calibrate.diagnose.search.score import Removed, Scores, bic_gain
from calibrate.diagnose.search.searching import Key, cause_of
from calibrate.model.effects.term import Accepted, Term

REFINED = 6  # terms with inner values whose order is settled by their best values, not by those of the grid
NEAR = 0.3  # of the best gain, or of the one to beat: what the grid shows less of, no inner value brings up to it
EQUAL = 3  # decimals of BIC: what the readings cannot separate stays in the catalogue's order


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
    worth = NEAR * max(least, float(found.gain[coarse[0]]) if coarse else 0.0)
    inner = [e for e in coarse if bench.menu.entries[e].inner.size and found.gain[e] > worth][:REFINED]
    ready = {entry: _proposal(bench, found, without, entry) for entry in inner}
    gains = {entry: ready[entry].gain if entry in ready else float(found.gain[entry]) for entry in coarse}
    for entry in sorted(coarse, key=lambda e: -round(gains[e], EQUAL)):
        if gains[entry] <= least:
            return
        yield ready[entry] if entry in ready else _proposal(bench, found, without, entry)


def _best_entries(bench: Bench, found: Scores, barred: frozenset[Key]) -> list[int]:
    """The best entry of every key, best first; of equal ones the first of the catalogue."""
    out: dict[Key, int] = {}
    for entry in np.argsort(-np.round(found.gain, EQUAL), kind="stable"):
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
