"""All that has no name, at one state: open terms of the catalogue, and a curve at every port over every driver."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined, solved
from calibrate.diagnose.search.null import gains_of
from calibrate.diagnose.search.port_process import (
    WAVES,
    Processes,
    places_of,
    processes,
)
from calibrate.diagnose.search.score import Removed, bic_gain, scores
from calibrate.model.effects.curve import SmoothCurve
from calibrate.model.effects.ports import Place
from calibrate.model.effects.term import Accepted, Term

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Allowed = Callable[[Term], bool]

PAIRED = (Place.JOINTS, Place.READING)  # pairs of drivers are sought at these ports: others seldom want any


@dataclass(frozen=True)
class Offer:
    """An open term, and what it would gain in a model without some of the terms."""

    term: Term
    inner: Floats
    gain: float


@dataclass(frozen=True, eq=False)
class Families:
    """All open families at one state."""

    bench: Bench
    processes: tuple[Processes, ...]

    def best(self, without: Removed | None, allowed: Allowed, least: float = 0.0) -> Offer | None:
        """The best offer of those allowed with more than the `least` gain, in a model with some terms taken out."""
        found = self._of_catalogue(without, allowed, least)
        for some in self.processes:
            more = some.best(self.bench.sight.residual, _mask(some.curves, allowed), without, least)
            if more is not None and (found is None or more[1] > found.gain):
                found = Offer(some.curves[more[0]], np.zeros(0), more[1])
            least = least if found is None else max(least, found.gain)
        return found

    def maxima(self, left: Floats, allowed: Allowed) -> Floats:
        """(draw,) the best gain of all families in residuals (row, draw) that geometry has left."""
        drawn = [
            np.where(_mask(p.curves, allowed)[:, None], p.gains(left), -np.inf) for p in self.processes if p.curves
        ]
        menu = self.bench.open_menu
        if menu.entries:
            drawn.append(np.where(menu.of_terms(_mask(menu.terms, allowed))[:, None], gains_of(menu, left), -np.inf))
        return np.max(np.concatenate(drawn), axis=0) if drawn else np.zeros(0)

    def _of_catalogue(self, without: Removed | None, allowed: Allowed, least: float) -> Offer | None:
        menu = self.bench.open_menu
        if not menu.entries:
            return None
        gain = np.where(menu.of_terms(_mask(menu.terms, allowed)), scores(menu, without).gain, -np.inf)
        best = int(np.argmax(gain))
        if gain[best] <= least:
            return None
        entry = menu.entries[best]
        return Offer(menu.terms[entry.term], entry.inner, float(gain[best]))


@lru_cache(maxsize=1)
def open_families(bench: Bench) -> Families:
    """Every single driver at every port, pairs of them where they may be sought; the last bench's are kept."""
    places = places_of(bench)
    paired = tuple((port, c) for port, c in places if port.place in PAIRED)
    return Families(bench, (processes(bench, places, 1), processes(bench, paired, 2)))


def anything(term: Term) -> bool:
    """No restriction."""
    return True


def fitted_curve(bench: Bench, offer: Offer, without: Removed | None) -> Accepted:
    """An offer with its values, a curve with as many waves as the data pay for."""
    if not isinstance(offer.term, SmoothCurve):
        return refined(bench, offer.term, offer.inner, without)
    rss = bench.sight.rss + (without.squares if without is not None else 0.0)

    def gain(term: SmoothCurve, squares: float) -> float:
        return float(bic_gain(np.array(squares), rss, np.array(term.numbers), bench.sight.data))

    trials = [replace(offer.term, waves=m) for m in range(2, WAVES[len(offer.term.depends_on)] + 1)]
    found = [(term, *solved(bench, term, offer.inner, without)) for term in trials]
    best = max(found, key=lambda f: gain(f[0], f[2]))
    return Accepted(best[0], best[1], offer.inner)


def _mask(terms: Sequence[Term], allowed: Allowed) -> Bools:
    return np.array([allowed(term) for term in terms], dtype=bool)
