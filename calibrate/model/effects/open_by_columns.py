"""Open families of recorded columns: every further column and every temperature, at every port
that it could act on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calibrate.model.effects.curves import centred
from calibrate.model.effects.drivers import SHORTEST_M, Drivers, link_vectors
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.laser_pointing import of_beam
from calibrate.model.effects.moved import motion
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.psd_terms import spot
from calibrate.model.effects.term import Floats, Form, Shape, Term, at_joint
from calibrate.model.effects.time_laws import Law, varies
from calibrate.model.sensors import spots
from calibrate.model.sensors.kind import Trait

LIMIT_RAD = 5e-2
LIMIT_M = 1e-2
LIMIT = 0.05  # relative


@dataclass(frozen=True)
class Column:
    """A recorded column as driver; its law has mean 0 and rms 1, so coefficients are plain sizes at the port."""

    name: str
    values: Floats  # (pose,)
    temperature: bool  # named effects have it at base, device, laser and links

    def law(self, drivers: Drivers, inner: Floats) -> Floats:
        return centred(drivers, self.values)[:, None]


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    columns = [Column(name, x, False) for name, x in drivers.extra.items() if varies(x)]
    columns += [Column(f"temp_{where}", T, True) for where, T in drivers.temperatures_degC.items() if varies(T)]
    return tuple(term for column in columns for places in PLACES for term in places(drivers, column))


def _at_joints(drivers: Drivers, column: Column) -> list[Term]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        port, direction = at_joint(joint, drivers.n_joints)
        out.append(_open(port, column, column.law, ("size_rad",), LIMIT_RAD, f"Joint {joint} turns", direction))
    return out


def _at_links(drivers: Drivers, column: Column) -> list[Term]:
    if column.temperature:
        return []
    out: list[Term] = []
    for link in range(1, drivers.n_joints + 1):
        along = link_vectors(drivers, link)[0]
        length = float(np.linalg.norm(along))
        if length >= SHORTEST_M:
            direction = np.concatenate([along / length, np.zeros(3)])[:, None]
            port = Port(f"link{link}.length", Place.FRAME, link)
            out.append(_open(port, column, column.law, ("size_m",), LIMIT_M, f"Link {link} grows", direction))
    return out


def _around(drivers: Drivers, column: Column) -> list[Term]:
    if column.temperature:
        return []
    places = [("base.pose", "The base")]
    if drivers.having(Trait.DEVICE):
        places.append(("device.pose", "The measuring device"))
    if drivers.light is not None:
        places.append(("fixture.pose", "The fixture"))
    return [
        motion(where, "unknown", column.name, Shape.LINEAR, column.law, what, open_family=True)
        for where, what in places
    ]


def _at_tool(drivers: Drivers, column: Column) -> list[Term]:
    out: list[Term] = []
    if drivers.light is not None and not column.temperature:
        out += of_beam(drivers, "unknown", column.name, Shape.LINEAR, column.law, open_family=True)
    if drivers.having(Trait.TARGET):
        names = ("size_x_m", "size_y_m", "size_z_m")
        port = Port("tool.point", Place.FRAME, drivers.n_joints)
        out.append(_open(port, column, column.law, names, LIMIT_M, "The target shifts", np.eye(6)[:, :3]))
    return out


def _at_detectors(drivers: Drivers, column: Column) -> list[Term]:
    """Shift and gain of each detector."""
    if drivers.light is None:
        return []
    out: list[Term] = []
    for detector in (1, 2):
        port = Port(f"psd{detector}.reading", Place.READING, instrument=spots.KIND.name)
        both = np.eye(4)[:, 2 * detector - 2 : 2 * detector]
        what = f"PSD {detector}"
        out.append(_open(port, column, column.law, ("size_x_m", "size_y_m"), LIMIT_M, f"{what} shifts", both))
        out.append(
            _open(port, column, _gain(column, detector), ("gain_share",), LIMIT, f"{what} is scaled", None, "gain")
        )
    return out


def _at_devices(drivers: Drivers, column: Column) -> list[Term]:
    if column.temperature:
        return []  # device-scale has it
    return [
        _open(
            Port("device.reading", Place.READING, instrument=name),
            column,
            _stretch(column, name),
            ("scale_share",),
            LIMIT,
            "The measuring device's scale changes",
            None,
            "scale",
        )
        for name in drivers.having(Trait.DEVICE)
    ]


def _gain(column: Column, detector: int) -> Law:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        out = np.zeros((len(drivers.t_s), 4, 1))
        out[:, 2 * detector - 2 : 2 * detector, 0] = spot(drivers, detector) * column.law(drivers, inner)
        return out

    return function


def _stretch(column: Column, name: str) -> Law:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        seen = np.nan_to_num(drivers.readouts[name].predicted) * column.law(drivers, inner)
        seen[:, 3:] = 0.0
        return seen[:, :, None]

    return function


def _open(
    port: Port,
    column: Column,
    function: Law,
    names: tuple[str, ...],
    limit: float,
    what: str,
    directions: Floats | None,
    variant: str = "",
) -> Term:
    sizes = ", ".join(f"{{{name}}}" for name in names)
    return Form(
        port,
        (column.name,),
        Shape.LINEAR,
        "unknown",
        variant=variant,
        open=True,
        function=function,
        names=names,
        limit=limit,
        sentence=f"{what} with {column.name}, by {sizes} for its usual swing; why is not known",
        directions=directions,
    )


PLACES: tuple[Callable[[Drivers, Column], list[Term]], ...] = (
    _at_joints,
    _at_links,
    _around,
    _at_tool,
    _at_detectors,
    _at_devices,
)

EFFECT = Kind(
    "unknown",
    "Something that was recorded goes along with an error, and no entry of this catalogue explains it.",
    ("link-thermal-growth", "laser-thermal-drift", "base-moved"),
    "mismatch lesson 8 of section 10: every unrecorded driver is a name that cannot be given",
    _terms,
)
