"""The interface of the catalogue, and the usual form of a term.

A term is one piece of physics at one port of one session, linear in coefficients.

An effect (one file each) lists the terms that a session allows: `terms(drivers)`. The search uses the columns only;
names, units, limits and sentences stay with the term. Sizes are written as an engineer reads them, "68.0 ± 2.0 µrad
per Nm": the unit comes from the end of the name.

Its usual form (`Form`): functions of drivers, one column each, along fixed directions of the port.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.quantities import decimals_of

Floats = NDArray[np.float64]
Functions = Callable[[Drivers, Floats], Floats]  # (pose, m) or (pose, width, m) for inner values (inner,)
# (pose, 1 or width) for coefficients (m,) and inner values (inner,)
Exact = Callable[[Drivers, Floats, Floats], Floats]
Plausible = Callable[[Floats, Floats], bool]  # of coefficients (m,) and inner values (inner,)
INNER_STEP = 1e-3  # of the range of an inner value, for its difference quotient
NOISE_ALLOWS = 30.0  # times the data's own noise: a coarse machine may be worse than a limit for good ones


class Shape(Enum):
    """Words of docs/formats.md."""

    CONSTANT = "constant"
    LINEAR = "linear"
    QUADRATIC = "quadratic"
    CUBIC = "cubic"
    HARMONIC = "harmonic"
    SIGN = "sign"
    HYSTERESIS = "hysteresis"
    EXPONENTIAL = "exponential"
    STEP = "step"
    PRODUCT = "product"
    RADIAL = "radial"
    SMOOTH = "smooth"


@dataclass(frozen=True)
class Inner:
    """A parameter that enters non-linearly: a step's time, a time constant, a period."""

    name: str  # with its unit: "time_s"
    grid: tuple[float, ...]  # coarse values for the search; a line search follows
    lower: float
    upper: float
    discrete: bool = False  # only a search finds it (a step's time): the refit leaves it alone
    later: bool = False  # than the one before it: an end, which follows its begin


@dataclass(frozen=True)
class Size:
    """A parameter as a person reads it."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Term(ABC):
    """One candidate. Subclasses are frozen dataclasses with what they need to know."""

    port: Port
    depends_on: tuple[str, ...]  # driver names of docs/formats.md
    shape: Shape
    physics: str  # of docs/formats.md
    order: int | None = None
    inner: tuple[Inner, ...] = ()
    slow: bool = False  # a function of time: has to beat a wandering null, too
    variant: str = ""  # separates terms that a person would give one name
    open: bool = False  # an open family (spline, product, unknown period): competes, but names no physics

    @abstractmethod
    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        """(pose, width of the port, coefficient) what each coefficient adds at the port, for inner values (inner,)."""

    def amount(self, drivers: Drivers, coefficients: Floats, inner: Floats) -> Floats:
        """(pose, width) the exact formula; override where it is not linear in the coefficients."""
        return self.basis(drivers, inner) @ coefficients

    @abstractmethod
    def sizes(self, coefficients: Floats, covariance: Floats, inner: Floats, inner_sigma: Floats) -> Mapping[str, Size]:
        """Parameters with units in their names, from coefficients and their covariance."""

    @abstractmethod
    def plausible(self, coefficients: Floats, inner: Floats, noise_rad: float) -> bool:
        """Whether a real machine could have this size. `noise_rad`: a floor on limits, from the data's own noise."""

    @abstractmethod
    def says(self, sizes: Mapping[str, Size]) -> str:
        """One plain sentence with size and unit."""

    @property
    def key(self) -> tuple[str, tuple[str, ...], str, int | None, str, str]:
        """What makes it the same term."""
        return (self.port.where, self.depends_on, self.shape.value, self.order, self.physics, self.variant)

    @property
    def smooth(self) -> list[int]:
        """Numbers of the inner values that a fit moves."""
        return [j for j, spec in enumerate(self.inner) if not spec.discrete]


class Holds(Enum):
    """Of which rows an effect is true."""

    ALWAYS = "always"  # of the machine, on any day
    SESSION = "session"  # of one recording's clock only


@dataclass(frozen=True)
class Missing:
    """A driver that an effect needs and the session does not hold."""

    driver: str
    column: str  # how it would be named in samples.csv, or the rig key
    physics: str


class Effect(Protocol):
    """A kind of physics of the catalogue; a module-level instance in each file, one line in effects/catalogue.py."""

    @property
    def physics(self) -> str: ...

    @property
    def explains(self) -> str:
        """One sentence of physics."""
        ...

    @property
    def source(self) -> str:
        """Paper, section, manual page."""
        ...

    @property
    def holds(self) -> Holds:
        """Of a term that does not follow the clock; one that does is true of its session only."""
        ...

    def terms(self, drivers: Drivers, /) -> tuple[Term, ...]:
        """Where in this session it could sit."""
        ...

    def missing(self, drivers: Drivers, /) -> tuple[Missing, ...]:
        """What would have to be recorded for it to be found."""
        ...


NOT_DETERMINED = "(not determined by these data)"


# Ending of a name, with (from this size on, factor, unit), largest first. The first ending that fits is taken.
Steps = tuple[tuple[float, float, str], ...]


UNITS: tuple[tuple[str, Steps], ...] = (
    ("phase_rad", ((0.0, 57.29577951308232, "°"),)),
    ("_rad_per_rad", ((1e-2, 1e3, "mrad per rad"), (0.0, 1e6, "µrad per rad"))),
    ("_rad_nm", ((1e-2, 1e3, "mrad per Nm"), (0.0, 1e6, "µrad per Nm"))),
    ("_rad_n", ((0.0, 1e6, "µrad per N"),)),
    ("_rad_per_k", ((0.0, 1e6, "µrad per K"),)),
    ("_m_per_k", ((1e-3, 1e3, "mm per K"), (0.0, 1e6, "µm per K"))),
    ("_share_per_k", ((0.0, 1e6, "ppm per K"),)),
    ("_per_k", ((0.0, 1e6, "µm per m and K"),)),
    ("waves_x_per_m", ((0.0, 1e-3, "a mm"),)),
    ("waves_y_per_m", ((0.0, 1e-3, "a mm"),)),
    ("_per_m_per_m", ((0.0, 1e6, "ppm per m²"),)),
    ("_per_m", ((0.0, 1e6, "ppm per m"),)),
    ("_nm_per_rad", ((0.0, 1.0, "Nm per rad"),)),
    ("_nms_per_rad", ((0.0, 1.0, "Nm per rad/s"),)),
    ("_kg_m2", ((0.0, 1.0, "kg m²"),)),
    ("_kg_m", ((0.0, 1.0, "kg m"),)),
    ("_kg", ((0.0, 1.0, "kg"),)),
    ("speed_rad_s", ((0.0, 1e3, "mrad/s"),)),
    ("_nm_per_k", ((0.0, 1.0, "Nm per K"),)),
    ("_nm", ((0.0, 1.0, "Nm"),)),
    ("_rad", ((1e-2, 1e3, "mrad"), (0.0, 1e6, "µrad"))),
    ("_m", ((1.0, 1.0, "m"), (1e-3, 1e3, "mm"), (0.0, 1e6, "µm"))),
    ("_s", ((60.0, 1.0, "s"), (1.0, 1.0, "s"), (0.0, 1e3, "ms"))),
    ("_share", ((1e-3, 1e2, "%"), (0.0, 1e6, "ppm"))),
    ("_per_turn", ((0.0, 1.0, "a turn"),)),
)


def plain(name: str, size: Size) -> str:
    """Value, sigma and unit of a size with its unit in its name: 68.0 ± 2.0 µrad per Nm. No number without a sigma."""
    if not math.isfinite(size.sigma):
        return NOT_DETERMINED
    for ending, steps in UNITS:
        if name.endswith(ending):
            scale, unit = next((s, u) for least, s, u in steps if abs(size.value) >= least)
            space = "" if unit in ("°", "%") else " "
            return f"{with_sigma(scale * size.value, scale * size.sigma)}{space}{unit}"
    return with_sigma(size.value, size.sigma)


def with_sigma(value: float, sigma: float) -> str:
    """Two digits of the sigma, and the value to the same decimal: 68.3 ± 2.1; without a sigma four digits."""
    if not (math.isfinite(sigma) and sigma > 0.0):
        return f"{value:.4g}"
    decimals = decimals_of(sigma)
    return f"{value:z.{decimals}f} ± {sigma:.{decimals}f}"


@dataclass(frozen=True)
class Accepted:
    """A term in the model, with its values."""

    term: Term
    coefficients: Floats  # (coefficient,)
    inner: Floats  # (inner,)

    @property
    def values(self) -> Floats:
        """(value,) coefficients, then smooth inner values."""
        return np.concatenate([self.coefficients, self.inner[self.term.smooth]])

    def at(self, drivers: Drivers) -> Floats:
        """(pose, width) what it adds at its port."""
        return self.term.amount(drivers, self.coefficients, self.inner)

    def by_inner(self, amount: Callable[[Floats], Floats]) -> list[Floats]:
        """Of each smooth inner value (pose, width, 1), by a difference quotient of the amount (pose, width) at inner
        values (inner,).
        """
        out: list[Floats] = []
        for j in self.term.smooth:
            low, high, spec = self.inner.copy(), self.inner.copy(), self.term.inner[j]
            step = INNER_STEP * (spec.upper - spec.lower)
            low[j], high[j] = low[j] - step / 2.0, high[j] + step / 2.0
            out.append(((amount(high) - amount(low)) / step)[..., None])
        return out


@dataclass(frozen=True)
class Form(Term):
    """`names` of the coefficients with units; `limit` of what they may add at the port, rad or m or relative."""

    function: Functions = field(kw_only=True)
    names: tuple[str, ...] = field(kw_only=True)
    limit: float = field(kw_only=True)
    sentence: str = field(kw_only=True)  # with {name} for sizes, in the units of `names`
    reversed_sentence: str = field(kw_only=True, default="")  # where the first size is below zero, of its opposite
    directions: Floats | None = field(kw_only=True, default=None)  # (width, d); None: the function has its own
    about: Callable[[Drivers], Floats] | None = field(kw_only=True, default=None)  # directions that follow the session
    polar: bool = field(kw_only=True, default=False)  # coefficients are (sine, cosine): reported as amplitude, phase
    exact: Exact | None = field(kw_only=True, default=None)  # where `function` is the first order only
    believable: Plausible | None = field(kw_only=True, default=None)  # what is more than a limit of size

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        values, directions = self.function(drivers, inner), self.along(drivers)
        if directions is None:
            return values
        product = np.einsum("nm,wd->nwmd", values, directions)
        return product.reshape(len(values), len(directions), -1)

    def along(self, drivers: Drivers) -> Floats | None:
        """(width, d) directions of the port; None where the function has its own at each pose."""
        return self.directions if self.about is None else self.about(drivers)

    def amount(self, drivers: Drivers, coefficients: Floats, inner: Floats) -> Floats:
        if self.exact is None:
            return self.basis(drivers, inner) @ coefficients
        values = self.exact(drivers, coefficients, inner)
        return values if self.directions is None else values @ self.directions.T

    def sizes(self, coefficients: Floats, covariance: Floats, inner: Floats, inner_sigma: Floats) -> Mapping[str, Size]:
        sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        out = _polar(self.names, coefficients, covariance) if self.polar else _plain(self.names, coefficients, sigma)
        for spec, value, own_sigma in zip(self.inner, inner, inner_sigma, strict=True):
            out[spec.name] = Size(float(value), float(own_sigma))
        return out

    def plausible(self, coefficients: Floats, inner: Floats, noise_rad: float) -> bool:
        if self.believable is not None and not self.believable(coefficients, inner):
            return False
        return bool(np.max(np.abs(coefficients), initial=0.0) <= max(self.limit, NOISE_ALLOWS * noise_rad))

    def of_a_difference(self) -> "Form":
        """The same where it may be of either sign: one of two recordings has more of it."""
        if (one := self.believable) is None:
            return self

        def either(values: Floats, inner: Floats) -> bool:
            return one(values, inner) or one(-values, inner)

        return replace(self, believable=either)

    def says(self, sizes: Mapping[str, Size]) -> str:
        sentence, (first, *_) = self.sentence, self.names
        if self.reversed_sentence and first in sizes and sizes[first].value < 0.0:
            sentence = self.reversed_sentence
            sizes = {**sizes, first: Size(-sizes[first].value, sizes[first].sigma)}
        return sentence.format(**{name: plain(name, size) for name, size in sizes.items()})


def at_joint(joint: int, n_joints: int) -> tuple[Port, Floats]:
    """Port and direction of an error of one joint's angle."""
    direction = np.zeros((n_joints, 1))
    direction[joint - 1] = 1.0
    return Port(f"joint{joint}.angle", Place.JOINTS), direction


def _plain(names: tuple[str, ...], values: Floats, sigma: Floats) -> dict[str, Size]:
    return {name: Size(float(v), float(s)) for name, v, s in zip(names, values, sigma, strict=True)}


def _polar(names: tuple[str, ...], values: Floats, covariance: Floats) -> dict[str, Size]:
    """Of a sin x + b cos x = A sin(x + phase): amplitude, phase, with first-order sigmas."""
    a, b = values
    amplitude = float(np.hypot(a, b))
    by = np.array([[a, b], [-b / max(amplitude, 1e-300), a / max(amplitude, 1e-300)]]) / max(amplitude, 1e-300)
    determined = bool(np.isfinite(np.diag(covariance)).all())
    sigma = np.sqrt(np.maximum(np.diag(by @ covariance @ by.T), 0.0)) if determined else np.full(2, np.inf)
    return {
        names[0]: Size(amplitude, float(sigma[0])),
        names[1]: Size(float(np.arctan2(b, a)), float(min(sigma[1], np.pi)) if determined else np.inf),
    }
