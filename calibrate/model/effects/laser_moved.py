"""The laser was seated again, slipped in its mount, or was pulled aside for a while: its beam is another line then."""

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.moved import LASER, line_of
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import (
    Form,
    Holds,
    Inner,
    Shape,
    Term,
)

LIMIT = 1e-2  # m, rad: farther, and no session goes on


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if drivers.light is None or drivers.rig.tool.laser_direction is None:
        return ()
    out: list[Term] = []
    if inner := time_laws.step_inner(drivers):
        out.append(_moved(drivers, time_laws.step, inner, "", ": seated again, or slipped in its mount"))
    if inner := time_laws.while_inner(drivers):
        pulled = ": pulled aside, by its cable or a hand"
        out.append(_moved(drivers, time_laws.for_a_while(), inner, time_laws.FOR_A_WHILE, pulled))
    return tuple(out)


def _moved(drivers: Drivers, law: time_laws.Law, inner: tuple[Inner, ...], variant: str, ending: str) -> Term:
    return Form(
        Port("laser.direction", Place.FRAME, drivers.n_joints),
        ("t",),
        Shape.STEP,
        "laser-moved",
        None,
        inner,
        slow=True,
        variant=variant,
        function=law,
        directions=line_of(drivers),
        names=LASER,
        limit=LIMIT,
        sentence="The laser moved by {shift_u_m}, {shift_v_m} and turned by {tilt_u_rad}, {tilt_v_rad} across its "
        "beam" + time_laws.when(inner) + ending,
    )


EFFECT = Kind(
    "laser-moved",
    "A laser that was unscrewed or knocked points along another line; its beam stays the same line of the flange then.",
    ("encoder-slip", "base-moved"),
    "four numbers of a line, as calibrate/model/optics/laser.py has them",
    _terms,
    holds=Holds.SESSION,
)
