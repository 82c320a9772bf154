"""The measuring device drifts or is bumped: its frame is no longer where it was."""

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.kind import Kind
from calibrate.effects.moved import drifts, motion
from calibrate.effects.term import Holds, Shape, Term
from calibrate.sensors.kind import Trait


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not drivers.having(Trait.DEVICE):
        return ()
    out = drifts(drivers, "device.pose", "device-drift", "The measuring device")
    if inner := time_laws.step_inner(drivers):
        out.append(
            motion("device.pose", "device-drift", "t", Shape.STEP, time_laws.step, "The measuring device", inner)
        )
    return tuple(out)


EFFECT = Kind(
    "device-drift",
    "A tripod settles or warms, and the frame of the tracker or drum moves with it.",
    ("base-moved",),
    "ASME B89.4.19-2006, app. D (drift of laser trackers); motion of the base has exactly the same effect",
    _terms,
    holds=Holds.SESSION,
)
