"""The base, or the table under everything, drifts or is bumped."""

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.kind import Kind
from calibrate.effects.moved import drifts, motion
from calibrate.effects.term import Holds, Shape, Term


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out = drifts(drivers, "base.pose", "base-moved", "The base")
    if inner := time_laws.step_inner(drivers):
        out.append(motion("base.pose", "base-moved", "t", Shape.STEP, time_laws.step, "The base", inner))
    return tuple(out)


EFFECT = Kind(
    "base-moved",
    "A base that is not tight, or a table on a warming floor, carries the arm away from what it is measured against.",
    ("device-drift", "fixture-moved", "link-thermal-growth"),
    "mismatch catalogue: base or table drift, bump",
    _terms,
    holds=Holds.SESSION,
)
