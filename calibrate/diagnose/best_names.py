"""Each accepted term by the name that a full refit likes best; of names that the data cannot tell apart, that of
the fewest drivers and of the lowest harmonic (numbers are paid for by BIC already).

The search compares candidates by linear scores, which are off by some units of BIC where robust weights or inner values
would settle elsewhere.
"""

from dataclasses import replace

import numpy as np

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.rivals import Rival, rivals_of
from calibrate.diagnose.searching import BETTER, Search
from calibrate.effects.term import Term

# Of BIC: no more than a bare mention. Source: Kass, Raftery, Bayes factors, J. Am. Stat. Assoc. 90(430), 1995, section
# 3.2.
TIED = 2.0
ROUNDS = 6
WARMTH = "temp_"

Rivals = tuple[tuple[Rival, ...], ...]


def with_best_names(at: Search) -> tuple[Search, Rivals]:
    """The search with names exchanged, and the rivals of each term in it."""
    for _ in range(ROUNDS):
        rivals = _rivals(at.bench)
        changed = _exchanged(at, rivals)
        if changed is None:
            return at, rivals
        at = changed
    return at, _rivals(at.bench)


def _rivals(bench: Bench) -> Rivals:
    return tuple(() if a.term.open else rivals_of(bench, i) for i, a in enumerate(bench.state.accepted))


def _exchanged(at: Search, rivals: Rivals) -> Search | None:
    """With the first name exchanged that has a better one; None if there is none."""
    for i, (own, mine) in enumerate(zip(at.state.accepted, rivals, strict=True)):
        class_ = [(0.0, own), *((r.margin, r.accepted) for r in mine if r.refitted and r.plausible)]
        class_ = [(margin + _price(at.bench, a.term), a) for margin, a in class_]
        least = min(margin for margin, _ in class_)
        near = [c for c in class_ if c[0] <= least + TIED]
        best = min(near, key=lambda c: (len(c[1].term.depends_on), c[1].term.order or 1, *_rank(at, c, least, own)))[1]
        if best is own:
            continue
        bench = Bench(at.state.refitted([best if j == i else a for j, a in enumerate(at.state.accepted)]))
        dearer = _price(at.bench, best.term) - _price(at.bench, own.term)
        if bench.bic + dearer <= at.bench.bic + TIED:
            return replace(at.at(bench), p=at.p | {best.term.key: at.p.get(own.term.key, 0.0)})
    return None


def _rank(at: Search, candidate: tuple[float, Accepted], least: float, own: Accepted) -> tuple[float, int]:
    """By margin; a hair's breadth is no reason: what nothing tells apart is named in the catalogue's order."""
    margin, accepted = candidate
    if margin <= least + BETTER:
        return least, at.bench.menu.place_of(accepted.term)
    return (margin - BETTER if accepted is own else margin), 0


def _price(bench: Bench, term: Term) -> float:
    """BIC of having picked a thermometer: the one at the place itself is free, any other one of many.

    Source: extended BIC, Chen, Chen, Biometrika 95(3), 2008, gamma = 1.
    """
    driver, where = term.depends_on[0], term.port.where
    if not driver.startswith(WARMTH) or where.startswith(driver.removeprefix(WARMTH) + "."):
        return 0.0
    return 2.0 * float(np.log(max(len(bench.state.drivers.temperatures_degC), 1)))
