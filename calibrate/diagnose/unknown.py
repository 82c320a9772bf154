"""When no name is final: open families against what was named, and structure that nothing named explains.

A closed grammar misnames what it does not hold, mostly at the right port; so at every port the named terms compete
with a curve over any drivers, and an open family that beats them by more than 10 BIC forbids the names (very strong
evidence, Kass, Raftery, J. Am. Stat. Assoc. 90(430), 1995, section 3.2).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.curve import Curve
from calibrate.diagnose.line_search import refined, solved
from calibrate.diagnose.linearised import Accepted
from calibrate.diagnose.noise_law import noise_law
from calibrate.diagnose.null import gains_of, is_slow
from calibrate.diagnose.port_process import WAVES, Processes, places_of, processes
from calibrate.diagnose.score import Removed, bic_gain, gain_of, removed, scores
from calibrate.diagnose.search import ALPHA_FURTHER, SURE, Key, Search, grown_out
from calibrate.diagnose.tail import Tail
from calibrate.effects.ports import Place
from calibrate.effects.term import Term

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

DRAWS = 120
FORBIDS = 10.0  # BIC by which an open family beats the best name
ROUNDS = 6
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

    def best(self, without: Removed | None, fast: bool) -> Offer | None:
        """The best offer; `fast`: no function of time, where noise may wander."""
        offers = [o for o in (self._of_catalogue(without, fast), *self._curves(without, fast)) if o is not None]
        return max(offers, key=lambda offer: offer.gain, default=None)

    def maxima(self, left: Floats, fast: bool) -> Floats:
        """(draw,) the best gain of all families in residuals (row, draw) that geometry has left."""
        drawn = [
            np.where(_allowed(p.curves, fast)[:, None], p.gains(left), -np.inf) for p in self.processes if p.curves
        ]
        menu = self.bench.open_menu
        if menu.entries:
            drawn.append(np.where(menu.of_terms(_allowed(menu.terms, fast))[:, None], gains_of(menu, left), -np.inf))
        return np.max(np.concatenate(drawn), axis=0) if drawn else np.zeros(0)

    def _curves(self, without: Removed | None, fast: bool) -> list[Offer]:
        out: list[Offer] = []
        for some in self.processes:
            if not some.curves:
                continue
            gains = some.gains(self.bench.sight.residual[:, None], without)[:, 0]
            best = int(np.argmax(np.where(_allowed(some.curves, fast), gains, -np.inf)))
            out.append(Offer(some.curves[best], np.zeros(0), float(gains[best])))
        return out

    def _of_catalogue(self, without: Removed | None, fast: bool) -> Offer | None:
        menu = self.bench.open_menu
        if not menu.entries:
            return None
        gain = np.where(menu.of_terms(_allowed(menu.terms, fast)), scores(menu, without).gain, -np.inf)
        best = int(np.argmax(gain))
        entry = menu.entries[best]
        return Offer(menu.terms[entry.term], entry.inner, float(gain[best]))


def _allowed(terms: Sequence[Term], fast: bool) -> Bools:
    return np.array([not (fast and is_slow(term)) for term in terms], dtype=bool)


def with_unknowns(at: Search) -> Search:
    """Names replaced where an open family forbids them, curves added where structure remains."""
    for _ in range(ROUNDS):
        families = _families(at.bench)
        changed = _forbidden(at, families) or _remaining(at, families)
        if changed is None:
            return at
        at = changed
    return at


def _families(bench: Bench) -> Families:
    places = places_of(bench)
    paired = tuple((port, c) for port, c in places if port.place in PAIRED)
    return Families(bench, (processes(bench, places, 1), processes(bench, paired, 2)))


def _forbidden(at: Search, families: Families) -> Search | None:
    """The names of one port given up for an open family, the clearest case first."""
    cases: list[tuple[float, tuple[int, ...], Offer, Removed]] = []
    for group in _groups(at):
        gone = removed(at.state, at.bench.sight, group)
        offer = families.best(gone, fast=False)
        if offer is not None and (margin := offer.gain - gain_of(gone, at.bench.sight)) > _enough(at, group):
            cases.append((margin, group, offer, gone))
    for _, group, offer, gone in sorted(cases, key=lambda case: -case[0]):
        new = _fitted_curve(at.bench, offer, gone)
        kept = [a for i, a in enumerate(at.state.accepted) if i not in group]
        trial = _with(
            at, [*kept, new], {new.term.key: min(at.p.get(at.state.accepted[i].term.key, 0.0) for i in group)}
        )
        if trial.bench.bic < at.bench.bic - _enough(at, group):
            return trial
    return None


def _enough(at: Search, group: tuple[int, ...]) -> float:
    """BIC by which one open cause has to beat these names: less for every name more, each picked out of the catalogue.

    Source: extended BIC, Chen, Chen, Biometrika 95(3), 2008, gamma = 1.
    """
    picked = 2.0 * float(np.log(max(len(at.bench.menu.terms), 1)))
    return FORBIDS - picked * (len(group) - 1)


def _groups(at: Search) -> list[tuple[int, ...]]:
    """Accepted names by port, and all of them together."""
    named = [i for i, a in enumerate(at.state.accepted) if not a.term.open]
    ports = {at.state.accepted[i].term.port.where for i in named}
    groups = [tuple(i for i in named if at.state.accepted[i].term.port.where == where) for where in sorted(ports)]
    return groups if len(groups) < 2 else [*groups, tuple(named)]


def _remaining(at: Search, families: Families) -> Search | None:
    """An open term for structure that is significant against the null of all open families."""
    law = noise_law(at.state.rows, at.bench.sight, at.state.drivers.t_s, at.rng)
    offer = families.best(None, fast=law.wanders)
    if offer is None or offer.gain <= 0.0 or any(a.term.key == offer.term.key for a in at.state.accepted):
        return None
    p = 0.0
    if offer.gain < SURE:
        noise = law.draw(at.rng, DRAWS)
        left = noise - at.bench.sight.basis @ (at.bench.sight.basis.T @ noise)
        p = Tail(families.maxima(left, law.wanders)).p(offer.gain)
    if p > ALPHA_FURTHER:
        return None
    new = _fitted_curve(at.bench, offer, None)
    trial = _with(at, [*at.state.accepted, new], {new.term.key: p})
    return trial if trial.bench.bic < at.bench.bic else None


def _fitted_curve(bench: Bench, offer: Offer, without: Removed | None) -> Accepted:
    """With as many waves as the data pay for."""
    if not isinstance(offer.term, Curve):
        return refined(bench, offer.term, offer.inner, without)
    rss = bench.sight.rss + (without.squares if without is not None else 0.0)

    def gain(term: Curve, squares: float) -> float:
        return float(bic_gain(np.array(squares), rss, np.array(term.numbers), bench.sight.data))

    trials = [replace(offer.term, waves=m) for m in range(2, WAVES[len(offer.term.depends_on)] + 1)]
    found = [(term, *solved(bench, term, offer.inner, without)) for term in trials]
    best = max(found, key=lambda f: gain(f[0], f[2]))
    return Accepted(best[0], best[1], offer.inner)


def _with(at: Search, accepted: list[Accepted], tested: Mapping[Key, float]) -> Search:
    """Refitted with these terms, and searched on from there; `tested`: family-wise p of new ones."""
    bench = Bench(at.state.refitted(accepted))
    known = at.p | dict(tested)
    p = {a.term.key: known.get(a.term.key, 0.0) for a in accepted}
    return grown_out(replace(at.at(bench), p=p))
