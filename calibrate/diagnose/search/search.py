"""Which terms the data ask for: best first, swap, backward; every change is confirmed by a refit.

Greedy selection alone is wrong as soon as two effects share a lever, so after every acceptance each chosen term is
tried against all others. Sources: stepwise search with swaps, Miller, Subset selection in regression, 2002, section
3.7; term-by-term model building of telescopes, Wallace, TPOINT.

Steps that robust weights have swallowed: shots at a fixture that stood elsewhere for a while resemble outlying rows.
Trusted again, they propose the step; it stays where a robust refit is certain.

Terms exchanged for better ones: each in turn for any other, and groups of surrogates for the one behind them.
"""

from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.random import Generator

from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.growing import admissible, grown
from calibrate.diagnose.search.null import is_slow
from calibrate.diagnose.search.pruning import balances, confirmed, p_of, tidied
from calibrate.diagnose.search.score import gain_of, removed, scores
from calibrate.diagnose.search.searching import Key, Search, null_at, taken
from calibrate.diagnose.state.linearised import State
from calibrate.model.effects.term import Accepted, Shape
from calibrate.model.effects.time_laws import FEWEST_AFTER

Group = tuple[int, ...]


def swapped(at: Search) -> Search:
    """Every chosen term tried against all others, the most promising exchange first."""
    refused: frozenset[tuple[Key, Key]] = frozenset()
    for _ in range(limits.SWAPS):
        best: tuple[float, int, Accepted] | None = None
        for i, gone in enumerate(at.bench.gone):
            own = at.state.accepted[i].term.key
            worth = gain_of(gone, at.bench.sight)
            barred = taken(at.bench, (i,)) | {new for old, new in refused if old == own} | {own}
            least = max(worth + limits.BETTER, best[0] + worth if best else -np.inf)
            found = scores(at.bench.menu, gone)
            proposed = admissible(at.bench, found, gone, least, barred)
            if proposed is not None:
                best = (proposed.gain - worth, i, proposed.accepted)
        if best is None:
            return at
        _, i, proposed = best
        old = at.state.accepted[i].term.key
        bench = Bench(at.state.refitted([proposed if j == i else a for j, a in enumerate(at.state.accepted)]))
        if bench.bic < at.bench.bic - limits.BETTER and bench.plausible[i] and not balances(bench, at.bench):
            p = {k: v for k, v in at.p.items() if k != old} | {proposed.term.key: at.p.get(old, 0.0)}
            at = replace(at.at(bench), p=p)
        else:
            refused = refused | {(old, proposed.term.key)}
    return at


def merged(at: Search) -> Search:
    """Several terms exchanged for one: surrogates share a port, a driver or a lever, and none of them can go alone."""
    refused: frozenset[tuple[Group, Key]] = frozenset()
    for _ in range(limits.SWAPS):
        best: tuple[float, Group, Accepted] | None = None
        for group in _groups(at):
            gone = removed(at.state, at.bench.sight, group)
            worth = gain_of(gone, at.bench.sight)
            barred = taken(at.bench, group) | {new for old, new in refused if old == group}
            found = scores(at.bench.menu, gone)
            least = max(worth + limits.BETTER, best[0] + worth if best else -np.inf)
            proposed = admissible(at.bench, found, gone, least, barred)
            if proposed is not None:
                best = (proposed.gain - worth, group, proposed.accepted)
        if best is None:
            return at
        _, group, proposed = best
        kept = [a for j, a in enumerate(at.state.accepted) if j not in group]
        bench = Bench(at.state.refitted([*kept, proposed]))
        if bench.bic < at.bench.bic - limits.BETTER and bench.plausible[-1]:
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
    if len(terms) <= limits.PAIRED:
        found |= set(combinations(range(len(terms)), 2)) | {tuple(range(len(terms)))}
    return sorted(group for group in found if len(group) > 1)


def search(state: State, rng: Generator) -> Search:
    """All closed terms that beat the null of the whole catalogue, in a model in which each one is needed.

    Those that the state begins with are usual ones.
    """
    return settled(grown_out(Search(Bench(state), rng, usual=frozenset(a.term.key for a in state.accepted))))


def settled(at: Search) -> Search:
    """Each term confirmed by draws: a search goes on from sure ones without."""
    return tidied(confirmed(at))


def grown_out(at: Search) -> Search:
    """Grown, swapped and pruned until nothing changes."""
    at = tidied(swapped(at))
    vanished: frozenset[Key] = frozenset()  # added, and gone again when the others had found their places
    vanished_in_a_row = 0
    for _ in range(limits.MOST_TERMS):
        open_to = replace(at, banned=at.banned | vanished)
        new = grown(open_to) if len(at.state.accepted) < limits.MOST_TERMS else None
        new = with_untrusted_step(open_to) if new is None else new
        if new is None and (new := merged(at)) is at:
            break
        trial, tried = _at_rest(new)
        if trial.bench.bic < at.bench.bic - limits.BETTER:
            at, vanished_in_a_row = trial, 0
        elif (added := tried - at.keys - vanished) and vanished_in_a_row + 1 < limits.VANISHED_IN_A_ROW:
            vanished, vanished_in_a_row = vanished | added, vanished_in_a_row + 1
        else:
            break
    return at


def _at_rest(new: Search) -> tuple[Search, frozenset[Key]]:
    """Swapped and pruned; and the keys that were in it on the way."""
    exchanged = swapped(new)
    return tidied(exchanged), new.keys | exchanged.keys


def with_untrusted_step(at: Search) -> Search | None:
    """With the best step for rows that nobody trusts; None if there are few of them, or no step explains them."""
    if at.state.distrusted < FEWEST_AFTER:
        return None
    trusting = at.state.trusting()
    whole = Bench(trusting)
    steps = tuple(t for t in whole.candidates if t.shape is Shape.STEP and not t.open)
    bench = Bench(trusting, whole.menu_of(steps))
    proposed = admissible(bench, bench.scores, None, 0.0, at.causes | at.banned)
    if proposed is None:
        return None
    trial = Bench(at.state.refitted((*at.state.accepted, proposed.accepted)))
    if trial.bic >= at.bench.bic or not trial.plausible[-1]:
        return None
    # Picked for its outlying rows, so the null, which has none, is no judge: heavy tails make such steps, too.
    if gain_of(trial.gone[-1], trial.sight) < limits.SURE_SLOW:
        return None
    p = p_of(trial, null_at(trial, at.rng, limits.FEW_NULL_DRAWS), len(trial.state.accepted) - 1)
    return replace(at.at(trial), p=at.p | {proposed.term.key: p})
