"""The laser points elsewhere as it gets warmer or colder."""

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.laser_pointing import of_beam
from calibrate.model.effects.term import Missing, Shape, Term
from calibrate.model.effects.time_laws import varies


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if drivers.light is None or drivers.rig.tool.laser_direction is None:
        return ()
    return tuple(
        term
        for where, T in drivers.temperatures_degC.items()
        if varies(T)
        for term in of_beam(
            drivers,
            "laser-thermal-drift",
            f"temp_{where}",
            Shape.LINEAR,
            lambda d, inner, where=where: time_laws.with_temperature(where, d, inner),
        )
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    if drivers.light is None or drivers.temperatures_degC:
        return ()
    return (Missing("temp", "temp_<where>_degC", "laser-thermal-drift"),)


EFFECT = Kind(
    "laser-thermal-drift",
    "Beam pointing of a diode module follows its temperature, 2 to 12 µrad per K.",
    ("laser-warm-up", "base-moved"),
    "mismatch catalogue: laser pointing",
    _terms,
    _missing,
)
