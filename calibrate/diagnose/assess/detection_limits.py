"""How small an effect these poses could have shown: what "nothing is there" is worth, cause by cause.

A size is visible if the search finds it 19 times out of 20 among as many candidates at a family-wise 5 %: its square
behind geometry is that of a normal deviate beyond the Bonferroni limit by the 95 % quantile (power of a one-sided test
of a normal mean; Cohen, Statistical Power Analysis, 1988, section 2.3, with the variance known).

Which causes these poses can separate, also before anything is measured.

R2 between the subspaces of two candidates behind geometry: the share of one's visible square that the other can
imitate, averaged over its directions. Source: isolability matrices of structural diagnosis, Frisk, Krysander, Jung, A
toolbox for analysis and design of model based diagnosis systems, IFAC PapersOnLine 50(1), 2017, here with magnitudes.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from calibrate.diagnose import limits as shared_limits
from calibrate.diagnose.assess import limits
from calibrate.diagnose.assess.diagnosis import Named
from calibrate.diagnose.assess.findings import NO_SIZE, named
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.score import directions
from calibrate.diagnose.state.visible import EntryBlock, Menu
from calibrate.model.effects.term import Term

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Isolability:
    """`r2[a, b]`: how much of a's signal b could explain. Terms that nothing shows are left out."""

    terms: tuple[Term, ...]
    r2: Floats  # (term, term)

    def confusable(self, level: float = limits.CONFUSABLE) -> tuple[tuple[Term, Term, float], ...]:
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


LEVEL, POWER = 0.05, 0.95


@dataclass(frozen=True)
class Smallest:
    """The smallest size of a cause that would have been found."""

    name: Named
    parameter: str  # with its unit
    value: float
    plausible: bool  # False: no machine is so bad, so these poses do not show the cause at all


def smallest_visible(bench: Bench) -> tuple[Smallest, ...]:
    """Of every place and physics that the poses show, by its best-seen form; inner values at the middle of the grid."""
    menu, best = bench.menu, dict[tuple[str, str], Smallest]()
    needed = (ndtri(POWER) - ndtri(LEVEL / (2.0 * max(len(menu.entries), 1)))) ** 2
    middle = {entry.term: i for i, entry in enumerate(menu.entries) if _is_middle(bench, i)}
    for block in menu.blocks:
        for at, i in enumerate(block.entries):
            if middle.get(menu.entries[i].term) != i:
                continue
            found = _smallest(bench, int(i), _coefficients(block, at, float(needed)))
            if found is None:
                continue
            key = (found.name.where, found.name.physics)
            if key not in best or (found.parameter == best[key].parameter and found.value < best[key].value):
                best[key] = found
    return tuple(best.values())


def _is_middle(bench: Bench, i: int) -> bool:
    entry = bench.menu.entries[i]
    grids = [inner.grid for inner in bench.menu.terms[entry.term].inner]
    return all(value == grid[len(grid) // 2] for value, grid in zip(entry.inner, grids, strict=True))


def _coefficients(block: EntryBlock, at: int, needed: float) -> Floats | None:
    """(k,) which together show the needed square; None where they show nothing."""
    seen = np.maximum(np.diag(block.gram[at]), 0.0)  # below zero by rounding where geometry can be all of it
    if not np.any(seen > shared_limits.VISIBLE):
        return None
    size = block.size[at] * np.sqrt(seen)
    share = math.sqrt(needed / np.sum(seen > shared_limits.VISIBLE))
    return np.where(seen > shared_limits.VISIBLE, share / np.where(size > 0.0, size, 1.0), 0.0)


def _smallest(bench: Bench, i: int, coefficients: Floats | None) -> Smallest | None:
    if coefficients is None:
        return None
    entry = bench.menu.entries[i]
    term, k = bench.menu.terms[entry.term], len(coefficients)
    sizes = term.sizes(coefficients, np.zeros((k, k)), entry.inner, np.zeros(len(entry.inner)))
    sized = {name: abs(s.value) for name, s in sizes.items() if not name.startswith(NO_SIZE) and s.value != 0.0}
    if not sized:
        return None
    name, value = next(iter(sized.items()))
    if not math.isfinite(value):
        return None
    return Smallest(named(term), name, value, term.plausible(coefficients, entry.inner, bench.noise_rad))
