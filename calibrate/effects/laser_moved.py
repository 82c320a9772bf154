"""The laser was seated again, or slipped in its mount: from some moment on its beam is another line of the flange."""

from calibrate.effects import time_laws
from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Form
from calibrate.effects.kind import Kind
from calibrate.effects.ports import Place, Port
from calibrate.effects.since_model import LASER, line_of
from calibrate.effects.term import Holds, Shape, Term

LIMIT = 1e-2  # m, rad: farther, and no session goes on


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    inner = time_laws.step_inner(drivers)
    if drivers.light is None or drivers.rig.tool.laser_direction is None or not inner:
        return ()
    return (
        Form(
            Port("laser.direction", Place.FRAME, drivers.n_joints),
            ("t",),
            Shape.STEP,
            "laser-moved",
            None,
            inner,
            slow=True,
            function=time_laws.step,
            directions=line_of(drivers),
            names=LASER,
            limit=LIMIT,
            sentence="The laser moved by {shift_u_m}, {shift_v_m} and turned by {tilt_u_rad}, {tilt_v_rad} across its "
            "beam from {time_s} on: seated again, or slipped in its mount",
        ),
    )


EFFECT = Kind(
    "laser-moved",
    "A laser that was unscrewed or knocked points along another line; its beam stays the same line of the flange then.",
    ("encoder-slip", "base-moved"),
    "four numbers of a line, as calibrate/sensors/laser.py has them",
    _terms,
    holds=Holds.SESSION,
)
