"""The base, or the table under everything, drifts or is bumped."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import bumped, drifts
from calibrate.model.effects.term import Holds, Term


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    base = ("base.pose", "base-moved", "The base")
    return (*drifts(drivers, *base), *bumped(drivers, *base))


EFFECT = Kind(
    "base-moved",
    "A base that is not tight, or a table on a warming floor, carries the arm away from what it is measured against.",
    ("device-drift", "fixture-moved", "link-thermal-growth"),
    "mismatch catalogue: base or table drift, bump",
    _terms,
    holds=Holds.SESSION,
)
