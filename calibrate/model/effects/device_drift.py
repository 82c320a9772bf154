"""The measuring device drifts or is bumped: its frame is no longer where it was."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import bumped, drifts
from calibrate.model.effects.term import Holds, Term
from calibrate.model.sensors.kind import Trait


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not drivers.having(Trait.DEVICE):
        return ()
    device = ("device.pose", "device-drift", "The measuring device")
    return (*drifts(drivers, *device), *bumped(drivers, *device))


EFFECT = Kind(
    "device-drift",
    "A tripod settles or warms, and the frame of the tracker or drum moves with it.",
    ("base-moved",),
    "ASME B89.4.19-2006, app. D (drift of laser trackers); motion of the base has exactly the same effect",
    _terms,
    holds=Holds.SESSION,
)
