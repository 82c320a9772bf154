"""When no name is final: open families against what was named, and structure that nothing named explains.

A closed grammar misnames what it does not hold, mostly at the right port; so at every port the named terms compete
with a curve over any drivers, and an open family that beats them by more than 10 BIC forbids the names (very strong
evidence, Kass, Raftery, J. Am. Stat. Assoc. 90(430), 1995, section 3.2). One refit judges an offer; the search goes on
from there once for all offers of a round.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from calibrate.diagnose.assess import limits
from calibrate.diagnose.limits import FEWEST_FOR_NAMES
from calibrate.diagnose.search import limits as search_limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.noise_law import NoiseLaw, noise_law
from calibrate.diagnose.search.null import Tail, is_slow
from calibrate.diagnose.search.open_families import (
    Allowed,
    Families,
    Offer,
    anything,
    fitted_curve,
    open_families,
)
from calibrate.diagnose.search.score import gain_of, removed
from calibrate.diagnose.search.search import grown_out, settled
from calibrate.diagnose.search.searching import Key, Search, cause_of, holds
from calibrate.errors import DataError
from calibrate.model.effects.curve import SmoothCurve
from calibrate.model.effects.ports import Place
from calibrate.model.effects.term import Accepted, Term

ROOM = "temp_room"

Keys = frozenset[Key]


@dataclass(frozen=True)
class Case:
    """Names against an open family."""

    keys: Keys
    offer: Offer
    margin: float  # BIC by which the offer is better, linearised


def with_unknowns(at: Search) -> Search:
    """Names replaced where an open family forbids them, curves added where structure remains.

    DataError for samples so few that a curve might take all that they leave.
    """
    if at.state.samples < FEWEST_FOR_NAMES:
        raise DataError(f"{at.state.samples} samples, fewer than {FEWEST_FOR_NAMES}: only named causes are sought")
    before, given_up, vanished = at.keys, frozenset[Keys](), frozenset[Key]()
    for _ in range(limits.UNKNOWN_ROUNDS):
        changed, gone = _forbidden(at, open_families(at.bench), given_up)
        given_up |= gone
        changed = _filled(changed, vanished, grown=changed is at)
        if changed is at:
            break
        new = grown_out(changed)
        vanished |= changed.keys - new.keys  # added, and gone again: the next round would do the same
        at = at if new.keys == at.keys else new
    return at if at.keys == before else settled(at)


def _forbidden(at: Search, families: Families, given_up: frozenset[Keys]) -> tuple[Search, frozenset[Keys]]:
    """With the names given up that an open family beats, the clearest case first; and which ones they were."""
    gone: frozenset[Keys] = frozenset()
    for case in sorted(_cases(at, families, given_up), key=lambda case: -case.margin):
        others = [a.term for a in at.state.accepted if a.term.key not in case.keys]
        if not case.keys <= at.keys or any(_balance(case.offer.term, other) for other in others):
            continue  # some of these names went with another case, or its curve is there already
        trial = _without_names(at, case)
        if trial.bench.bic < at.bench.bic - _enough(at, len(case.keys)):
            at, gone = trial, gone | {case.keys}
    return at, gone


def _cases(at: Search, families: Families, given_up: frozenset[Keys]) -> list[Case]:
    out: list[Case] = []
    for group in _groups(at):
        keys = frozenset(at.state.accepted[i].term.key for i in group)
        if keys in given_up:
            continue
        without = removed(at.state, at.bench.sight, group)
        worth = gain_of(without, at.bench.sight)
        offer = families.best(without, anything, max(0.0, worth + _enough(at, len(group))))
        if offer is not None and offer.term.key not in keys:
            out.append(Case(keys, offer, offer.gain - worth))
    return out


def _without_names(at: Search, case: Case) -> Search:
    group = tuple(i for i, a in enumerate(at.state.accepted) if a.term.key in case.keys)
    new = fitted_curve(at.bench, case.offer, removed(at.state, at.bench.sight, group))
    rest = [a for i, a in enumerate(at.state.accepted) if i not in group and a.term.key != new.term.key]
    kept = [a for a in rest if not _balance(new.term, a.term)]
    return _with(at, [*kept, new], {new.term.key: min(at.p.get(key, 0.0) for key in case.keys)})


def _enough(at: Search, count: int) -> float:
    """BIC by which one open cause has to beat so many names: less for every name more, each picked from the catalogue.

    Source: extended BIC, Chen, Chen, Biometrika 95(3), 2008, gamma = 1.
    """
    picked = 2.0 * float(np.log(max(len(at.bench.menu.terms), 1)))
    return limits.UNKNOWN_BEATS_NAME - picked * (count - 1)


def _groups(at: Search) -> list[tuple[int, ...]]:
    """Accepted terms by port, where something is named or a curve might be another, and the names among them; two names
    that all but cancel each other, wherever they are; and all names together.
    """
    terms = [a.term for a in at.state.accepted]
    groups = {
        tuple(i for i, term in enumerate(terms) if term.port.where == where)
        for where in {term.port.where for term in terms}
    }
    named = tuple(i for i, term in enumerate(terms) if not term.open)
    groups |= {tuple(i for i in named if terms[i].port.where == terms[j].port.where) for j in named}
    if len(named) > 1:
        groups |= {named} | {pair for pair in combinations(named, 2) if cancel(at.bench, pair)}
    return sorted(groups)


def cancel(bench: Bench, group: Sequence[int]) -> bool:
    """Whether accepted terms all but balance each other: no machine does, together they are something else."""
    felt = [bench.behind(bench.state.accepted[i]) for i in group]
    total = np.sum(felt, axis=0)
    return bool(total @ total < search_limits.CANCELS * sum(float(f @ f) for f in felt))


def _filled(at: Search, vanished: frozenset[Key], grown: bool) -> Search:
    """With open terms, none of them `vanished`, for structure that is significant against the null of all open terms.

    `grown`: no name is left that could be added; else a curve has to be better than any, too.
    """
    for turn in range(limits.CURVES_IN_A_ROW):
        least = 0.0 if grown and turn == 0 else _best_name(at) + limits.UNKNOWN_BEATS_NAME
        more = _remaining(at, vanished, least)
        if more is None:
            return at
        at = more
    return at


def _follows_room(term: Term) -> bool:
    """A joint's angle and the room's temperature: no part of a joint does, and what seems to is chance or a drift."""
    return term.port.place is Place.JOINTS and ROOM in term.depends_on


def _p_of(at: Search, families: Families, law: NoiseLaw, offer: Offer, allowed: Allowed) -> float:
    """That noise alone makes any open term that is allowed seem so good."""
    if offer.gain >= search_limits.SURE:
        return 0.0
    noise = law.draw(at.rng, limits.UNKNOWN_DRAWS)
    left = noise - at.bench.sight.basis @ (at.bench.sight.basis.T @ noise)
    return Tail(families.maxima(left, allowed)).p(offer.gain)


def _remaining(at: Search, vanished: frozenset[Key], least: float) -> Search | None:
    """With the best open term of more than the `least` gain that is not `vanished`."""
    families = open_families(at.bench)
    law = noise_law(at.state.rows, at.bench.sight, at.state.drivers.t_s, at.rng)
    free = _not_accepted([a.term for a in at.state.accepted])

    def allowed(term: Term) -> bool:
        return free(term) and term.key not in vanished and not (law.wanders and is_slow(term))

    offer = families.best(None, allowed, least)
    p = 1.0 if offer is None else _p_of(at, families, law, offer, allowed)
    if offer is not None and _follows_room(offer.term) and p > limits.ROOM_ALPHA:

        def at_other_places(term: Term) -> bool:
            return allowed(term) and not _follows_room(term)

        offer = families.best(None, at_other_places, least)
        p = 1.0 if offer is None else _p_of(at, families, law, offer, at_other_places)
    if offer is None or p > search_limits.ALPHA_FURTHER:
        return None
    new = fitted_curve(at.bench, offer, None)
    trial = _with(at, [*at.state.accepted, new], {new.term.key: p})
    return trial if trial.bench.bic < at.bench.bic else None


def _best_name(at: Search) -> float:
    """BIC that the best closed term would gain now: as long as a name may do, no curve is put in its place."""
    menu, taken = at.bench.menu, at.causes
    free = menu.of_terms(np.array([cause_of(term) not in taken for term in menu.terms], dtype=bool))
    return float(np.max(at.bench.scores.gain, where=free, initial=0.0))


def _not_accepted(accepted: Sequence[Term]) -> Allowed:
    """What is not one more function of the same drivers at the same place: two of those balance each other."""
    there: dict[str, list[Term]] = {}
    for other in accepted:
        there.setdefault(other.port.where, []).append(other)
    return lambda term: not any(_balance(term, other) for other in there.get(term.port.where, ()))


def _balance(new: Term, other: Term) -> bool:
    """Whether a curve and an accepted term would balance each other."""
    one, two = set(new.depends_on), set(other.depends_on)
    return holds(new, other) or (other.open and _spot(new) == _spot(other) and (one <= two or two <= one))


def _spot(term: Term) -> tuple[str, int]:
    """Port, and the component of it where it has several that are no matter of each other."""
    component = term.component if isinstance(term, SmoothCurve) and term.port.place is not Place.JOINTS else -1
    return term.port.where, component


def _with(at: Search, accepted: list[Accepted], tested: Mapping[Key, float]) -> Search:
    """Refitted with these terms; `tested`: family-wise p of new ones."""
    bench = Bench(at.state.refitted(accepted))
    known = at.p | dict(tested)
    return replace(at.at(bench), p={a.term.key: known.get(a.term.key, 0.0) for a in accepted})
