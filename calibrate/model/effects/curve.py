"""A smooth function of one or two drivers at one component of a port: for what no physics has a name.

Eigenfunctions of a box stand in for a Gaussian process. Source: Solin, Sarkka, Hilbert space methods for reduced-rank
Gaussian process regression, Stat. Comput. 30, 2020, section 3.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.causes import cause, centred, is_slow_cause
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Shape, Size, Term

Floats = NDArray[np.float64]

BOX = 1.3  # of the half range: eigenfunctions vanish at the edge of the box, data do not
UNKNOWN = "unknown"
WIDTHS = {Place.FRAME: 6, Place.SURROUNDINGS: 6}


@dataclass(frozen=True)
class Curve(Term):
    """`waves` eigenfunctions of each driver, products of them for two; at `component` of the port."""

    component: int = 0
    waves: int = 8

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        columns = features([cause(drivers, name) for name in self.depends_on], self.waves)
        return at_component(self.port, self.component, columns, drivers)

    def sizes(self, coefficients: Floats, covariance: Floats, inner: Floats, inner_sigma: Floats) -> Mapping[str, Size]:
        """Root mean square over the box, in the unit of the port."""
        rms = float(np.linalg.norm(coefficients) / np.sqrt(2.0) ** len(self.depends_on))
        along = coefficients / max(float(np.linalg.norm(coefficients)), 1e-300)
        sigma = float(np.sqrt(along @ covariance @ along) / np.sqrt(2.0) ** len(self.depends_on))
        return {f"rms_{self.unit}": Size(rms, sigma)}

    def plausible(self, coefficients: Floats, inner: Floats, noise_rad: float) -> bool:
        return bool(np.all(np.isfinite(coefficients)))

    def says(self, sizes: Mapping[str, Size]) -> str:
        (name, size), *_ = sizes.items()
        unit = name.removeprefix("rms_")
        what = " and ".join(self.depends_on)
        return f"Unknown cause at {self.port.where}, depends on {what}: {size.value:.2g} {unit} rms"

    @property
    def numbers(self) -> int:
        """Coefficients."""
        return self.waves ** len(self.depends_on)

    @property
    def unit(self) -> str:
        """Of the component."""
        return unit_of(self.port, self.component)


def unit_of(port: Port, component: int) -> str:
    """Of a component of a port: rad or m."""
    rotates = port.place is Place.JOINTS or (port.place in WIDTHS and component >= 3)
    return "rad" if rotates else "m"


def curve(port: Port, component: int, names: tuple[str, ...], waves: int) -> Curve:
    """A Curve with what follows from its drivers."""
    slow = all(is_slow_cause(name) for name in names)
    shape = Shape.SMOOTH if len(names) == 1 else Shape.PRODUCT
    return Curve(port, names, shape, UNKNOWN, slow=slow, open=True, component=component, waves=waves)


@dataclass(frozen=True)
class Unit(Curve):
    """Constant one at a component: its column is the sensitivity of all rows."""

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        return at_component(self.port, self.component, np.ones((len(drivers.t_s), 1)), drivers)


def unit(port: Port, component: int) -> Unit:
    """At a component of a port."""
    return Unit(port, (), Shape.CONSTANT, UNKNOWN, component=component)


def features(causes: list[Floats], waves: int) -> Floats:
    """(pose, waves ** driver) sines on the box around -1 ... 1."""
    order = np.arange(1, waves + 1)
    each: list[Floats] = [np.sin(np.pi * order * (centred(x)[:, None] + BOX) / (2.0 * BOX)) for x in causes]
    out = each[0]
    for other in each[1:]:
        out = (out[:, :, None] * other[:, None, :]).reshape(len(out), -1)
    return out


def frequencies(drivers: int, waves: int) -> Floats:
    """(driver, waves ** driver) of the features, in radians per half range."""
    one: Floats = np.arange(1.0, waves + 1.0) * (np.pi / (2.0 * BOX))
    if drivers == 1:
        return one[None]
    return np.stack([np.repeat(one, waves), np.tile(one, waves)])


def at_component(port: Port, component: int, columns: Floats, drivers: Drivers) -> Floats:
    """(pose, width, m) with columns (pose, m) at one component of a port."""
    match port.place:
        case Place.JOINTS:
            width = drivers.n_joints
        case Place.READING:
            width = drivers.readouts[port.instrument].predicted.shape[1]
        case _:
            width = WIDTHS[port.place]
    out = np.zeros((len(columns), width, columns.shape[1]))
    out[:, component] = columns
    return out
