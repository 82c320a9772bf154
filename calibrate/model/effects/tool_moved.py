"""The target was seated again, or creeps in its seat: it is elsewhere on the flange than before."""

import numpy as np

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import SIX
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import (
    Form,
    Holds,
    Inner,
    Shape,
    Term,
)
from calibrate.model.effects.time_laws import Law
from calibrate.model.sensors.kind import Trait

LIMIT_M = 5e-3  # farther, and it sits in another nest


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not drivers.having(Trait.TARGET):
        return ()
    out = [_moved(drivers, Shape.EXPONENTIAL, time_laws.towards, time_laws.constant_inner(drivers))]
    if inner := time_laws.step_inner(drivers):
        out.append(_moved(drivers, Shape.STEP, time_laws.step, inner))
    return tuple(out)


def _moved(drivers: Drivers, shape: Shape, law: Law, inner: tuple[Inner, ...]) -> Term:
    return Form(
        Port("tool.point", Place.FRAME, drivers.n_joints),
        ("t",),
        shape,
        "tool-moved",
        None,
        inner,
        slow=True,
        function=law,
        directions=np.eye(6)[:, :3],
        names=SIX[:3],
        limit=LIMIT_M,
        sentence="The target moved by {shift_x_m}, {shift_y_m}, {shift_z_m} in x, y, z of the flange"
        + time_laws.when(inner)
        + ": seated again, or creeping in its seat",
    )


EFFECT = Kind(
    "tool-moved",
    "A reflector that was taken out and put back, or a probe that was screwed on again, sits elsewhere by micrometres.",
    ("encoder-slip", "base-moved"),
    "ISO 10360-12:2016, 6.2 on fixing of the probe; makers state how well a retroreflector is centred in its nest",
    _terms,
    holds=Holds.SESSION,
)
