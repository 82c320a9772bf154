"""The state of a search: a model on the bench, and what refits have shown so far."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from calibrate.diagnose.search import limits
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.noise_law import noise_law
from calibrate.diagnose.search.null import Null, null_of
from calibrate.diagnose.state.linearised import State
from calibrate.model.effects.curve import SmoothCurve
from calibrate.model.effects.ports import Place
from calibrate.model.effects.second_encoders import placed
from calibrate.model.effects.term import Form, Shape, Term

Key = tuple[object, ...]

SMOOTH = (Shape.LINEAR, Shape.QUADRATIC, Shape.CUBIC, Shape.HARMONIC)  # a step, a sign or a decay is no smooth curve
PLACE = "place"  # what variants that name one begin with


@dataclass(frozen=True, eq=False)
class Search:
    """The search as it goes; every step gives another."""

    bench: Bench
    rng: Generator
    banned: frozenset[Key] = field(default_factory=frozenset)  # refits have refused them
    p: dict[Key, float] = field(default_factory=dict)  # family-wise, of every accepted term
    usual: frozenset[Key] = field(default_factory=frozenset)  # nobody had to search for them: no machine is without

    @property
    def state(self) -> State:
        return self.bench.state

    @property
    def keys(self) -> frozenset[Key]:
        return frozenset(a.term.key for a in self.state.accepted)

    @property
    def causes(self) -> frozenset[Key]:
        """Of the accepted terms, one term for one cause, whatever its variant; and what their curves hold already."""
        return taken(self.bench, ())

    def at(self, bench: Bench) -> "Search":
        """Banned terms have another chance as soon as the model is another."""
        return replace(self, bench=bench, banned=frozenset())


def taken(bench: Bench, gone: Collection[int]) -> frozenset[Key]:
    """Causes of the accepted terms but those in `gone`, and keys of what their curves hold already."""
    terms = [a.term for i, a in enumerate(bench.state.accepted) if i not in gone]
    curves = [term for term in terms if isinstance(term, SmoothCurve)]
    held = (t.key for t in bench.menu.terms if any(holds(curve, t) for curve in curves)) if curves else ()
    return frozenset(map(cause_of, terms)) | frozenset(held)


def holds(curve: Term, term: Term) -> bool:
    """Whether a smooth curve can be all that a term of the same place is: side by side they would balance each other
    where rows are, and part where there is none.
    """
    if not isinstance(curve, SmoothCurve) or not set(term.depends_on) <= set(curve.depends_on):
        return False
    slow = term.shape in SMOOTH and (term.order or 1) <= limits.HELD_HARMONICS
    return slow and curve.port == term.port and _within(curve, term)


def _within(curve: SmoothCurve, term: Term) -> bool:
    """Whether a term of the same port acts through the component of the curve alone."""
    if curve.port.place is Place.JOINTS:
        return True
    if not isinstance(term, Form) or term.directions is None:
        return False
    return set(np.flatnonzero(np.any(term.directions != 0.0, axis=1)).tolist()) == {curve.component}


def cause_of(term: Term) -> Key:
    """What a person would give one name: the key without the variant.

    Each place may have been bumped by itself, and each of two encoders has a disc of its own.
    """
    kept = term.variant if term.variant.startswith(PLACE) else placed(term)
    return (*term.key[:-1], kept)


def null_at(bench: Bench, rng: Generator, draws: int = limits.NULL_DRAWS) -> Null:
    """Null of a state, from its own residual."""
    law = noise_law(bench.state.rows, bench.sight, bench.state.drivers.t_s, rng)
    return null_of(bench.menu, law, rng, draws)
