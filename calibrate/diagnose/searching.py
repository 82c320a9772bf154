"""The state of a search: a model on the bench, and what refits have shown so far."""

from dataclasses import dataclass, field, replace

from numpy.random import Generator

from calibrate.diagnose.bench import Bench
from calibrate.diagnose.linearised import State
from calibrate.diagnose.noise_law import noise_law
from calibrate.diagnose.null import Null, null_of
from calibrate.diagnose.visible import Menu
from calibrate.effects.second_encoders import placed
from calibrate.effects.term import Term

Key = tuple[object, ...]

ALPHA_FIRST = 0.03  # of 5 % for a whole diagnosis: the rest is for what has no name
ALPHA_DRIFT = 0.05  # of the first term against noise that wanders
ALPHA_FURTHER = 0.01
# Of BIC: accepted for now without drawing a null; the last check draws one for all. Slow ones face a wander, too.
SURE, SURE_SLOW = 60.0, 150.0
BETTER = 0.5  # of BIC, for an exchange
HELD = 2  # harmonics of a turn that a smooth curve over a part of it can be
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
        """Of the accepted terms, one term for one cause, whatever its variant; and what their curves hold already."""
        own = frozenset(cause_of(a.term) for a in self.state.accepted)
        curves = [a.term for a in self.state.accepted]
        return own | frozenset(cause_of(t) for t in self.bench.menu.terms if any(holds(curve, t) for curve in curves))

    def at(self, bench: Bench) -> "Search":
        """Banned terms have another chance as soon as the model is another."""
        return replace(self, bench=bench, banned=frozenset())


def holds(curve: Term, term: Term) -> bool:
    """Whether a smooth curve can be all that a term of the same place is: side by side they would balance each other
    where rows are, and part where there is none.
    """
    smooth = curve.open and not curve.variant  # variants are of one shape: a bump, a period
    within = curve.port.where == term.port.where and set(term.depends_on) <= set(curve.depends_on)
    return smooth and within and (term.order or 1) <= HELD


def cause_of(term: Term) -> Key:
    """What a person would give one name: the key without the variant.

    Each place may have been bumped by itself, and each of two encoders has a disc of its own.
    """
    kept = term.variant if term.variant.startswith(PLACE) else placed(term)
    return (*term.key[:-1], kept)


def null_at(bench: Bench, rng: Generator, menu: Menu | None = None) -> Null:
    """Null of a state, from its own residual."""
    law = noise_law(bench.state.rows, bench.sight, bench.state.drivers.t_s, rng)
    return null_of(bench.menu if menu is None else menu, law, rng)
