"""Which terms the data ask for: best first, swap, backward; every change is confirmed by a refit.

Greedy selection alone is wrong as soon as two effects share a lever, so after every acceptance each chosen term is
tried against all others. Sources: stepwise search with swaps, Miller, Subset selection in regression, 2002, section
3.7; term-by-term model building of telescopes, Wallace, TPOINT.
"""

from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.line_search import refined
from calibrate.diagnose.linearised import Accepted, State
from calibrate.diagnose.noise_law import noise_law
from calibrate.diagnose.null import Null, is_slow, null_of
from calibrate.diagnose.score import Removed, Scores, gain_of, removed, scores
from calibrate.diagnose.visible import Menu
from calibrate.effects.term import Term

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Key = tuple[object, ...]
Group = tuple[int, ...]

ALPHA_FIRST = 0.03  # of 5 % for a whole diagnosis: the rest is for what has no name
ALPHA_FURTHER = 0.01
MOST = 30  # terms; beyond it the model form is wrong, not incomplete
# Of BIC: accepted for now without drawing a null; the last check draws one for all. Slow ones face a wander, too.
SURE, SURE_SLOW = 60.0, 150.0
AT_ONCE = 4  # sure ones that are accepted before a refit
SWAPS = 12  # in a row
BETTER = 0.5  # of BIC, for a swap
PAIRED = 8  # terms: up to so many, every pair is tried as one
PEERS = 8  # best entries that are looked at in turn for a plausible one
COLLINEAR = 0.05  # share of a term that the others leave: less is not a term of its own
COLLINEAR_COST = 6.0  # of BIC that dropping such a term may cost
CANCELS = 0.1  # square of the sum of a port's terms over the sum of their squares: less, and they are surrogates
PLACE = "place"  # what variants that name one begin with


@dataclass(frozen=True, eq=False)
class Search:
    """The search as it goes; every step gives another."""

    bench: Bench
    rng: Generator
    banned: frozenset[Key] = field(default_factory=frozenset)  # refits have refused them
    p: dict[Key, float] = field(default_factory=dict)  # family-wise, of every accepted term

    @property
    def state(self) -> State:
        return self.bench.state

    @property
    def keys(self) -> frozenset[Key]:
        return frozenset(a.term.key for a in self.state.accepted)

    @property
    def causes(self) -> frozenset[Key]:
        """Of the accepted terms: one term for one cause, whatever its variant."""
        return frozenset(cause_of(a.term) for a in self.state.accepted)

    def at(self, bench: Bench) -> "Search":
        """Banned terms have another chance as soon as the model is another."""
        return replace(self, bench=bench, banned=frozenset())


def cause_of(term: Term) -> Key:
    """What a person would give one name: the key without the variant; each place may have been bumped by itself."""
    return (*term.key[:-1], term.variant if term.variant.startswith(PLACE) else "")


def search(state: State, rng: Generator) -> Search:
    """All closed terms that beat the null of the whole catalogue, in a model in which each one is needed."""
    return grown_out(Search(Bench(state), rng))


def grown_out(at: Search) -> Search:
    """Grown, swapped and pruned until nothing changes, then each term confirmed."""
    at = _tidied(_swapped(at))
    for _ in range(MOST):
        grown = _grown(at) if len(at.state.accepted) < MOST else None
        if grown is None and (grown := _merged(at)) is at:
            break
        at = _tidied(_swapped(grown))
    return _tidied(confirmed(at))


def null_at(bench: Bench, rng: Generator, menu: Menu | None = None) -> Null:
    """Null of a state, from its own residual."""
    law = noise_law(bench.state.rows, bench.sight, bench.state.drivers.t_s, rng)
    return null_of(bench.menu if menu is None else menu, law, rng)


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


def _grown(at: Search) -> Search | None:
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
        entry = _entry_of(at.bench, found, proposed)
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
        if bench.bic < at.bench.bic:
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


def _entry_of(bench: Bench, found: Scores, proposed: Accepted) -> int:
    mine = [i for i, e in enumerate(bench.menu.entries) if bench.menu.terms[e.term].key == proposed.term.key]
    return mine[int(np.argmax(found.gain[mine]))]


def _swapped(at: Search) -> Search:
    """Every chosen term tried against all others, the most promising exchange first."""
    refused: frozenset[tuple[Key, Key]] = frozenset()
    for _ in range(SWAPS):
        best: tuple[float, int, Accepted] | None = None
        for i, gone in enumerate(at.bench.gone):
            own = at.state.accepted[i].term.key
            worth = gain_of(gone, at.bench.sight)
            taken = {cause_of(a.term) for j, a in enumerate(at.state.accepted) if j != i}
            barred = taken | {new for old, new in refused if old == own} | {own}
            least = max(worth + BETTER, best[0] + worth if best else -np.inf)
            found = scores(at.bench.menu, gone)
            proposed = admissible(at.bench, found, gone, least, frozenset(barred))
            if proposed is not None:
                better = float(found.gain[_entry_of(at.bench, found, proposed)]) - worth
                best = (better, i, proposed)
        if best is None:
            return at
        _, i, proposed = best
        old = at.state.accepted[i].term.key
        bench = Bench(at.state.refitted([proposed if j == i else a for j, a in enumerate(at.state.accepted)]))
        if bench.bic < at.bench.bic - BETTER:
            p = {k: v for k, v in at.p.items() if k != old} | {proposed.term.key: at.p.get(old, 0.0)}
            at = replace(at.at(bench), p=p)
        else:
            refused = refused | {(old, proposed.term.key)}
    return at


def _merged(at: Search) -> Search:
    """Several terms exchanged for one: surrogates share a port, a driver or a lever, and none of them can go alone."""
    refused: frozenset[tuple[Group, Key]] = frozenset()
    for _ in range(SWAPS):
        best: tuple[float, Group, Accepted] | None = None
        for group in _groups(at):
            gone = removed(at.state, at.bench.sight, group)
            worth = gain_of(gone, at.bench.sight)
            taken = {cause_of(a.term) for j, a in enumerate(at.state.accepted) if j not in group}
            barred = frozenset(taken | {new for old, new in refused if old == group})
            found = scores(at.bench.menu, gone)
            least = max(worth + BETTER, best[0] + worth if best else -np.inf)
            proposed = admissible(at.bench, found, gone, least, barred)
            if proposed is not None:
                best = (float(found.gain[_entry_of(at.bench, found, proposed)]) - worth, group, proposed)
        if best is None:
            return at
        _, group, proposed = best
        kept = [a for j, a in enumerate(at.state.accepted) if j not in group]
        bench = Bench(at.state.refitted([*kept, proposed]))
        if bench.bic < at.bench.bic - BETTER:
            p = {a.term.key: at.p.get(a.term.key, 0.0) for a in kept} | {proposed.term.key: 0.0}
            return _swapped(replace(at.at(bench), p=p))
        refused = refused | {(group, proposed.term.key)}
    return at


def _groups(at: Search) -> list[Group]:
    """Accepted terms that one other might stand for: of a port, of a driver, of a physics; and all pairs of few."""
    terms = [a.term for a in at.state.accepted]
    found: set[Group] = set()
    for labels in ([t.port.where for t in terms], [t.depends_on for t in terms], [t.physics for t in terms]):
        found |= {tuple(i for i, other in enumerate(labels) if other == label) for label in labels}
    if len(terms) <= PAIRED:
        found |= set(combinations(range(len(terms)), 2)) | {tuple(range(len(terms)))}
    return sorted(group for group in found if len(group) > 1)


def _tidied(at: Search) -> Search:
    """Backward: without terms that cost more than they are worth, or that the others can nearly replace."""
    while at.state.accepted:
        worth = np.array([gain_of(gone, at.bench.sight) for gone in at.bench.gone])
        allowed = np.where(at.bench.share < COLLINEAR, COLLINEAR_COST, 0.0)
        implausible = np.array(
            [not a.term.plausible(a.coefficients, a.inner, at.bench.noise_rad) for a in at.state.accepted]
        )
        over = np.where(implausible, -np.inf, worth - allowed)
        for i in surrogates(at.bench):
            over[i] = min(over[i], -1.0)
        worst = int(np.argmin(over))
        if over[worst] > 0.0:
            return at
        at = without(at, worst)
    return at


def surrogates(bench: Bench) -> list[int]:
    """Of every port whose terms all but cancel each other, the one that is worth least: no machine balances itself."""
    accepted = bench.state.accepted
    felt = np.stack([bench.behind(a) for a in accepted])
    out: list[int] = []
    for where in sorted({a.term.port.where for a in accepted}):
        mine = [i for i, a in enumerate(accepted) if a.term.port.where == where]
        if len(mine) > 1 and np.sum(felt[mine].sum(axis=0) ** 2) < CANCELS * np.sum(felt[mine] ** 2):
            out.append(min(mine, key=lambda i: bench.gone[i].squares))
    return out


def without(at: Search, i: int) -> Search:
    """Refitted without one accepted term, which is banned until the model is another."""
    kept = [a for j, a in enumerate(at.state.accepted) if j != i]
    gone = at.state.accepted[i].term.key
    bench = Bench(at.state.refitted(kept))
    return replace(at, bench=bench, banned=at.banned | {gone}, p={k: v for k, v in at.p.items() if k != gone})


def confirmed(at: Search) -> Search:
    """Each term against the null of the final residual; the least significant one goes first."""
    while at.state.accepted:
        null = null_at(at.bench, at.rng)
        p = {a.term.key: p_of(at.bench, null, i) for i, a in enumerate(at.state.accepted)}
        at = replace(at, p=p)
        values = np.array([p[a.term.key] for a in at.state.accepted])
        worst = int(np.argmax(values))
        if values[worst] <= (ALPHA_FURTHER if len(values) > 1 else ALPHA_FIRST):
            return at
        at = without(at, worst)
    return at


def p_of(bench: Bench, null: Null, i: int) -> float:
    """Family-wise probability of an accepted term's worth if there were nothing."""
    gone, term = bench.gone[i], bench.state.accepted[i].term
    return null.p_of_worth(is_slow(term), bench.sight, gone)
