"""Which causes these poses can separate, also before anything is measured.

R2 between the subspaces of two candidates behind geometry: the share of one's visible square that the other can
imitate, averaged over its directions. Source: isolability matrices of structural diagnosis, Frisk, Krysander, Jung, A
toolbox for analysis and design of model based diagnosis systems, IFAC PapersOnLine 50(1), 2017, here with magnitudes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.search.score import directions
from calibrate.diagnose.state.visible import Menu
from calibrate.model.effects.term import Term

Floats = NDArray[np.float64]

CONFUSABLE = 0.97


@dataclass(frozen=True)
class Isolability:
    """`r2[a, b]`: how much of a's signal b could explain. Terms that nothing shows are left out."""

    terms: tuple[Term, ...]
    r2: Floats  # (term, term)

    def confusable(self, level: float = CONFUSABLE) -> tuple[tuple[Term, Term, float], ...]:
        """Pairs that the poses cannot separate in either sense."""
        both = np.minimum(self.r2, self.r2.T)
        pairs = np.argwhere(np.triu(both >= level, 1))
        return tuple((self.terms[a], self.terms[b], float(both[a, b])) for a, b in pairs)


def isolability(menu: Menu) -> Isolability:
    """Of every visible term at the middle of its grid."""
    entries: dict[int, int] = {}
    for term in range(len(menu.terms)):
        mine = [i for i, entry in enumerate(menu.entries) if entry.term == term]
        if mine:
            entries[term] = mine[len(mine) // 2]
    spans = {term: directions(menu, entry) for term, entry in entries.items()}
    shown = [term for term, span in spans.items() if len(span)]
    if not shown:
        return Isolability((), np.zeros((0, 0)))
    stacked = np.concatenate([spans[term] for term in shown])
    owner = np.repeat(np.arange(len(shown)), [len(spans[term]) for term in shown])
    squares = (stacked @ stacked.T) ** 2
    by_column = np.add.reduceat(squares, np.flatnonzero(np.diff(owner, prepend=-1)), axis=1)
    summed = np.add.reduceat(by_column, np.flatnonzero(np.diff(owner, prepend=-1)), axis=0)
    return Isolability(tuple(menu.terms[t] for t in shown), summed / np.bincount(owner)[:, None])
