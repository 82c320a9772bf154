"""Which constants of the geometry two recordings differ by: the fewest that explain what all of them together do.

All constants that the instruments see are fitted at once, exactly and not linearised. Then, in the quadratic around
that fit, the part that costs least is taken back to the simulation's value, again and again, until each one that is
left is worth its numbers. Backward from the whole model a sum of two causes is not taken for a third one, which a
search that begins with nothing does. Price: extended BIC, Chen, Chen, Biometrika 95(3), 2008, gamma = 1.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.assess import Named
from calibrate.diagnose.state import Fitted, blind
from calibrate.model.effects.moved import RECORDING
from calibrate.model.effects.term import Shape
from calibrate.model.optics import GAINS
from calibrate.model.parameters import Parameter, plausible_sizes
from calibrate.model.placement import TARGETS
from calibrate.model.sensors import seat

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

ZERO = "joint-zero-moved"
LINK = "link-changed"
AXES = ("x", "y", "z")
TURNS = ("roll", "pitch", "yaw")
# Owner of parameters -> port and physics, as of a diagnosis beside a model (calibrate/model/effects/moved.py).
FRAMES = {
    "tool": ("tool.point", "tool-moved"),
    TARGETS: ("tool.point", "tool-moved"),
    "laser": ("laser.direction", "laser-moved"),
    "placement": ("fixture.pose", "fixture-moved"),
    seat.POINTS: ("seat.position", "seat-moved"),
    "psd2": ("psd2.reading", "psd-moved"),  # in the frame of PSD 1
}
LOST = 1e-12  # of a plausible size squared: a variance below is rounding, and the plausible size stands in for it
TIED = 2.0  # of BIC: no more than a bare mention (Kass, Raftery 1995)
RIVAL = 6.0  # of BIC: strong evidence against what is farther off (Kass, Raftery 1995)


@dataclass(frozen=True)
class Part:
    """Constants that stand or fall together: one zero, one number of a link, one frame."""

    where: str  # port, and the number of a station or cone
    physics: str
    names: tuple[str, ...]  # parameters

    @property
    def name(self) -> Named:
        return Named(self.where, (RECORDING,), Shape.CONSTANT.value, None, self.physics)


def parts_of(parameters: Sequence[Parameter]) -> tuple[Part, ...]:
    """All that are free in a session, in the order of its parameters; a device is set up again and no part."""
    groups: dict[tuple[str, str], list[str]] = {}
    for p in parameters:
        found = _place(p.name) if p.free else None
        if found is not None:
            groups.setdefault(found, []).append(p.name)
    return tuple(Part(where, physics, tuple(names)) for (where, physics), names in groups.items())


def _place(name: str) -> tuple[str, str] | None:
    owner, _, what = name.partition(".")
    kind = owner.rstrip("0123456789")
    number = owner.removeprefix(kind)
    if kind == "joint" and what == "zero":
        return f"{owner}.angle", ZERO
    if kind == "link":
        return name, LINK
    if owner in FRAMES:
        return None if name in GAINS else FRAMES[owner]
    if kind not in FRAMES:
        return None
    port, physics = FRAMES[kind]
    return f"{port} {number}", physics


def _inverse(information: Floats) -> Floats:
    return np.asarray(np.linalg.pinv(information, rcond=1e-14, hermitian=True), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Quadratic:
    """-2 log L around a fit in which the parts are free: away (value,) from the simulation, and the covariance."""

    parts: tuple[tuple[Part, Ints], ...]  # with their indices into the values
    away: Floats
    covariance: Floats
    rows: int
    price: float  # of a number

    @classmethod
    def of(cls, fitted: Fitted, values: Floats, parts: Sequence[Part]) -> "Quadratic":
        """`values` (param,) of the simulation, in the order of the session's parameters."""
        parameters = fitted.problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        at = {parameters[i].name: k for k, i in enumerate(free)}
        scale = plausible_sizes(parameters)[free]
        whole = np.concatenate([values, np.zeros(len(parameters) - len(values))])
        away = (fitted.values - whole)[free] / scale
        G = fitted.rows.geometry
        listed = tuple((p, np.array([at[n] for n in p.names], dtype=np.intp)) for p in parts)
        rows = int(fitted.rows.data.sum())
        return cls(listed, away, _inverse(G.T @ G), rows, float(np.log(rows) + 2.0 * np.log(max(len(listed), 1))))

    def cost(self, at: Ints) -> float:
        """Of taking these values back to the simulation's, all others following."""
        own = self.covariance[np.ix_(at, at)]
        return float(self.away[at] @ np.linalg.pinv(own, rcond=1e-12, hermitian=True) @ self.away[at])

    def without(self, part: Part) -> "Quadratic":
        """With the part at the simulation's values."""
        at = next(at for p, at in self.parts if p == part)
        C = self.covariance
        gain = C[:, at] @ np.linalg.pinv(C[np.ix_(at, at)], rcond=1e-12, hermitian=True)
        away, covariance = self.away - gain @ self.away[at], C - gain @ C[at]
        away[at], covariance[at], covariance[:, at] = 0.0, 0.0, 0.0
        left = tuple(one for one in self.parts if one[0] != part)
        return replace(self, parts=left, away=away, covariance=covariance)


def blind_zeros(fitted: Fitted, parts: Sequence[Part]) -> tuple[Part, ...]:
    """Zeros that next to no reading follows."""
    free = [p.name for p in fitted.problem.parameters if p.free]
    felt = np.linalg.norm(fitted.rows.geometry[fitted.rows.data], axis=0)
    return blind({part: float(felt[free.index(part.names[0])]) for part in parts if part.physics == ZERO})


def fewest(whole: Quadratic) -> tuple[Part, ...]:
    """The parts that are worth their numbers when all others are as in the simulation.

    Backward, a frame of six numbers goes before the six links that stand in for it; so each part that is gone is put
    back, and stays where the others that it makes needless then cost less.
    """
    chosen = _worth_their_numbers(whole)
    while True:
        tried = [_worth_their_numbers(_among(whole, (*chosen, p)), p) for p, _ in whole.parts if p not in chosen]
        best = min(tried, key=lambda parts: _dear(whole, parts), default=chosen)
        if _dear(whole, best) >= _dear(whole, chosen):
            return chosen
        chosen = best


def _worth_their_numbers(whole: Quadratic, kept: Part | None = None) -> tuple[Part, ...]:
    """Backward from all parts that are not held; `kept` goes last."""
    left = whole
    while spare := [(left.cost(at) - len(at) * whole.price, p) for p, at in left.parts if p != kept]:
        excess, part = min(spare, key=lambda one: one[0])
        if excess > 0.0:
            break
        left = left.without(part)
    return tuple(p for p, _ in left.parts)


def _among(whole: Quadratic, parts: tuple[Part, ...]) -> Quadratic:
    """With all but these at the simulation's values."""
    for part, _ in whole.parts:
        whole = whole if part in parts else whole.without(part)
    return whole


def _dear(whole: Quadratic, chosen: tuple[Part, ...]) -> float:
    """What the others, taken back, cost, and what the chosen ones do."""
    return _reduced(whole, chosen) + whole.price * sum(len(part.names) for part in chosen)


def outermost(whole: Quadratic, chosen: tuple[Part, ...]) -> tuple[Part, ...]:
    """A number of a link gives way to a joint's zero that explains as much: what hardly differs is named outside in."""
    for part in chosen:
        if part.physics != LINK:
            continue
        kept = _reduced(whole, chosen)
        zeros = [other for other, _ in whole.parts if other.physics == ZERO and other not in chosen]
        costs = [(_reduced(whole, _exchanged(chosen, part, zero)) - kept, zero) for zero in zeros]
        worse, zero = min(costs, key=lambda one: one[0], default=(np.inf, part))
        if worse < TIED:
            chosen = _exchanged(chosen, part, zero)
    return chosen


def _exchanged(chosen: tuple[Part, ...], part: Part, other: Part) -> tuple[Part, ...]:
    return tuple(other if one == part else one for one in chosen)


def alternatives(whole: Quadratic, chosen: Sequence[Part]) -> dict[Part, tuple[Named, ...]]:
    """Of each chosen part the others that could stand in its place, the remaining chosen ones being fitted again."""
    kept = _reduced(whole, chosen)
    return {part: tuple(_standing_in(whole, chosen, part, kept)) for part in chosen}


def undetected(whole: Quadratic, chosen: Sequence[Part]) -> dict[Part, Floats]:
    """Of each other part how far its numbers (n,) may be off without having been found, in plausible sizes.

    That is where a number is worth its price beside the chosen parts, at most its plausible size. A part that the
    readings do not separate from the chosen ones is left out: these are the sum, by convention.
    """
    alone = {p: np.diag(_among(whole, (*chosen, p)).covariance)[at] for p, at in whole.parts if p not in chosen}
    seen = {p: np.where(own > LOST, own, 1.0 / whole.price) for p, own in alone.items() if np.all(own < 1.0)}
    return {p: np.sqrt(np.minimum(whole.price * own, 1.0)) for p, own in seen.items()}


def _standing_in(whole: Quadratic, chosen: Sequence[Part], part: Part, kept: float) -> Iterator[Named]:
    own = len(part.names)
    for other, at in whole.parts:
        if other in chosen:
            continue
        worse = _reduced(whole, [*(p for p in chosen if p != part), other]) - kept
        if worse + (len(at) - own) * np.log(whole.rows) < RIVAL:
            yield other.name


def _reduced(whole: Quadratic, chosen: Sequence[Part]) -> float:
    """Cost of taking back all parts but the chosen ones, at once."""
    at = [a for p, a in whole.parts if p not in chosen]
    return whole.cost(np.concatenate(at)) if at else 0.0
