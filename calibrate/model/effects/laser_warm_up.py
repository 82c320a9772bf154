"""The laser points elsewhere while it warms up."""

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.laser_pointing import of_beam
from calibrate.model.effects.term import Holds, Shape, Term


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if drivers.light is None or drivers.rig.tool.laser_direction is None:
        return ()
    inner = time_laws.constant_inner(drivers)
    return of_beam(drivers, "laser-warm-up", "t", Shape.EXPONENTIAL, time_laws.towards, inner)


EFFECT = Kind(
    "laser-warm-up",
    "A diode's mount expands after switching on and turns the beam until it is in balance.",
    ("base-moved", "laser-thermal-drift"),
    "pointing stability of diode modules, 5 to 50 µrad over the first half hour (makers' data sheets)",
    _terms,
    holds=Holds.SESSION,
)
