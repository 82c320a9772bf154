"""Which terms the data ask for: best first, swap, backward; every change is confirmed by a refit.

Greedy selection alone is wrong as soon as two effects share a lever, so after every acceptance each chosen term is
tried against all others. Sources: stepwise search with swaps, Miller, Subset selection in regression, 2002, section
3.7; term-by-term model building of telescopes, Wallace, TPOINT.
"""

from dataclasses import replace

from numpy.random import Generator

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.exchanging import merged, swapped
from calibrate.diagnose.growing import grown
from calibrate.diagnose.linearised import State
from calibrate.diagnose.pruning import confirmed, tidied
from calibrate.diagnose.searching import BETTER, Key, Search
from calibrate.diagnose.swallowed import unswallowed

MOST = 30  # terms; beyond it the model form is wrong, not incomplete


def search(state: State, rng: Generator) -> Search:
    """All closed terms that beat the null of the whole catalogue, in a model in which each one is needed."""
    return grown_out(Search(Bench(state), rng))


def grown_out(at: Search) -> Search:
    """Grown, swapped and pruned until nothing changes, then each term confirmed."""
    at = tidied(swapped(at))
    vain: frozenset[Key] = frozenset()  # added, and gone again when the others had found their places
    for _ in range(MOST):
        open_to = replace(at, banned=at.banned | vain)
        new = grown(open_to) if len(at.state.accepted) < MOST else None
        new = unswallowed(open_to) if new is None else new
        if new is None and (new := merged(at)) is at:
            break
        trial = tidied(swapped(new))
        if trial.bench.bic < at.bench.bic - BETTER:
            at = trial
        elif added := new.keys - at.keys - vain:
            vain |= added
        else:
            break
    return tidied(confirmed(at))
