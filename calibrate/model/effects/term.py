"""The interface of the catalogue: a term is one piece of physics at one port of one session, linear in coefficients.

An effect (one file each) lists the terms that a session allows: `terms(drivers)`. The search uses the columns only;
names, units, limits and sentences stay with the term. Sizes are written as an engineer reads them, "68.0 ± 2.0 µrad
per Nm": the unit comes from the end of the name.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Port
from calibrate.quantities import decimals_of

Floats = NDArray[np.float64]


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


NOT_TOLD = "(not determined by these data)"

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
        return NOT_TOLD
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
