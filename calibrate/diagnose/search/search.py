"""Which terms the data ask for: best first, swap, backward; every change is confirmed by a refit.

Greedy selection alone is wrong as soon as two effects share a lever, so after every acceptance each chosen term is
tried against all others. Sources: stepwise search with swaps, Miller, Subset selection in regression, 2002, section
3.7; term-by-term model building of telescopes, Wallace, TPOINT.

Steps that robust weights have swallowed: shots at a fixture that stood elsewhere for a while resemble outlying rows.
Trusted again, they propose the step; it stays where a robust refit is certain.
"""

from dataclasses import replace

from numpy.random import Generator

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.exchanging import merged, swapped
from calibrate.diagnose.search.growing import admissible, grown
from calibrate.diagnose.search.pruning import confirmed, p_of, tidied
from calibrate.diagnose.search.score import gain_of
from calibrate.diagnose.search.searching import (
    BETTER,
    FEW_DRAWS,
    SURE_SLOW,
    Key,
    Search,
    null_at,
)
from calibrate.diagnose.state.linearised import State
from calibrate.model.effects.term import Shape
from calibrate.model.effects.time_laws import FEWEST_AFTER

MOST = 30  # terms; beyond it the model form is wrong, not incomplete
VAIN = 2  # additions in a row that were gone again: where many effects are mixed up, a third has never been of use


def search(state: State, rng: Generator) -> Search:
    """All closed terms that beat the null of the whole catalogue, in a model in which each one is needed."""
    return settled(grown_out(Search(Bench(state), rng)))


def settled(at: Search) -> Search:
    """Each term confirmed by draws: a search goes on from sure ones without."""
    return tidied(confirmed(at))


def grown_out(at: Search) -> Search:
    """Grown, swapped and pruned until nothing changes."""
    at = tidied(swapped(at))
    vain: frozenset[Key] = frozenset()  # added, and gone again when the others had found their places
    in_vain = 0
    for _ in range(MOST):
        open_to = replace(at, banned=at.banned | vain)
        new = grown(open_to) if len(at.state.accepted) < MOST else None
        new = unswallowed(open_to) if new is None else new
        if new is None and (new := merged(at)) is at:
            break
        trial, tried = _at_rest(new)
        if trial.bench.bic < at.bench.bic - BETTER:
            at, in_vain = trial, 0
        elif (added := tried - at.keys - vain) and in_vain + 1 < VAIN:
            vain, in_vain = vain | added, in_vain + 1
        else:
            break
    return at


def _at_rest(new: Search) -> tuple[Search, frozenset[Key]]:
    """Swapped and pruned; and the keys that were in it on the way."""
    exchanged = swapped(new)
    return tidied(exchanged), new.keys | exchanged.keys


def unswallowed(at: Search) -> Search | None:
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
    if gain_of(trial.gone[-1], trial.sight) < SURE_SLOW:
        return None
    p = p_of(trial, null_at(trial, at.rng, FEW_DRAWS), len(trial.state.accepted) - 1)
    return replace(at.at(trial), p=at.p | {proposed.term.key: p})
