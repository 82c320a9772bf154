"""A smooth function of one or two drivers at one component of a port: for what no physics has a name.

The drivers are everything in a session that an unknown effect might depend on, by the words of docs/formats.md.
Eigenfunctions of a box stand in for a Gaussian process. Source: Solin, Sarkka, Hilbert space methods for reduced-rank
Gaussian process regression, Stat. Comput. 30, 2020, section 3.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Shape, Size, Term

Floats = NDArray[np.float64]
LEAST_LEVELS = 4  # different values that a curve needs
SLOW = ("t", "temp_")
BOX = 1.3  # of the half range: eigenfunctions vanish at the edge of the box, data do not
UNKNOWN = "unknown"
TORQUE = ".torque"  # what a port of one joint's torque ends with
WIDTHS = {Place.FRAME: 6, Place.SURROUNDINGS: 6}


def causes_of(drivers: Drivers) -> dict[str, Floats]:
    """(pose,) by driver; those that vary, and in more than a few levels."""
    found = {name: cause(drivers, name) for name in _names(drivers)}
    return {name: values for name, values in found.items() if _varies(values)}


def cause(drivers: Drivers, name: str) -> Floats:
    """(pose,) of one driver that the session holds."""
    stem, number = name.rstrip("0123456789"), name[len(name.rstrip("0123456789")) :]
    by_joint = {
        "q": drivers.q_rad,
        "last_move": drivers.last_move_rad,
        "qd": drivers.qd_rad_s,
        "cmd_minus_q": drivers.cmd_minus_q_rad,
    }
    table = by_joint.get(stem)
    if number and table is not None:
        return table[:, int(number) - 1]
    temperature = drivers.temperatures_degC.get(name.removeprefix("temp_")) if name.startswith("temp_") else None
    if temperature is not None:
        return temperature
    single = {"t": drivers.t_s, "payload": drivers.payload_kg}
    if drivers.psd_sum_v is not None:
        single |= {"psd1_sum": drivers.psd_sum_v[:, 0], "psd2_sum": drivers.psd_sum_v[:, 1]}
    found = single.get(name)
    return drivers.extra[name] if found is None else found


def acts_at(name: str, where: str) -> bool:
    """Whether a driver could act at a port: how a joint moved matters at that joint."""
    stem = name.rstrip("0123456789")
    if stem not in ("last_move", "qd", "qdd", "tau", "cmd_minus_q"):
        return True
    return where.startswith(f"joint{name[len(stem) :]}.")


def _names(drivers: Drivers) -> list[str]:
    joints = range(1, drivers.n_joints + 1)
    names = ["t"] if drivers.clock_is_a_cause else []
    names += [*(f"q{i}" for i in joints), *(f"last_move{i}" for i in joints)]
    if drivers.qd_rad_s is not None:
        names += [f"qd{i}" for i in joints]
    if drivers.cmd_minus_q_rad is not None:
        names += [f"cmd_minus_q{i}" for i in joints]
    names += [f"temp_{where}" for where in drivers.temperatures_degC]
    if drivers.payload_kg is not None:
        names.append("payload")
    if drivers.psd_sum_v is not None:
        names += ["psd1_sum", "psd2_sum"]
    return [*names, *drivers.extra]


def is_slow_cause(name: str) -> bool:
    """A function of time, or what follows it."""
    return name == SLOW[0] or name.startswith(SLOW[1])


def centred(values: Floats) -> Floats:
    """Onto -1 ... 1."""
    low, high = float(np.min(values)), float(np.max(values))
    return (values - (low + high) / 2.0) / max((high - low) / 2.0, 1e-300)


def _varies(values: Floats) -> bool:
    return bool(np.all(np.isfinite(values))) and len(np.unique(values)) >= LEAST_LEVELS


@dataclass(frozen=True)
class SmoothCurve(Term):
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
    """Of a component of a port: rad or m, or nm of a torque."""
    if port.where.endswith(TORQUE):
        return "nm"
    rotates = port.place is Place.JOINTS or (port.place in WIDTHS and component >= 3)
    return "rad" if rotates else "m"


def curve(port: Port, component: int, names: tuple[str, ...], waves: int) -> SmoothCurve:
    """A Curve with what follows from its drivers."""
    slow = all(is_slow_cause(name) for name in names)
    shape = Shape.SMOOTH if len(names) == 1 else Shape.PRODUCT
    return SmoothCurve(port, names, shape, UNKNOWN, slow=slow, open=True, component=component, waves=waves)


@dataclass(frozen=True)
class Unit(SmoothCurve):
    """Constant one at a component: its column is the sensitivity of all rows."""

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        return at_component(self.port, self.component, np.ones((len(drivers.t_s), 1)), drivers)


def unit(port: Port, component: int) -> Unit:
    """At a component of a port."""
    return Unit(port, (), Shape.CONSTANT, UNKNOWN, component=component)


def features(causes: list[Floats], waves: int) -> Floats:
    """(pose, waves ** driver) sines on the box around -1 ... 1."""
    return _sines([centred(x) for x in causes], waves)


def features_within(causes: list[Floats], ranges: Sequence[tuple[float, float]], waves: int) -> Floats:
    """The same of drivers that once had these ranges; beyond them as at their ends."""
    pairs = zip(causes, ranges, strict=True)
    return _sines([centred(np.array([*r, *np.clip(x, *r)]))[2:] for x, r in pairs], waves)


def _sines(centred_causes: list[Floats], waves: int) -> Floats:
    order = np.arange(1, waves + 1)
    each: list[Floats] = [np.sin(np.pi * order * (x[:, None] + BOX) / (2.0 * BOX)) for x in centred_causes]
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
