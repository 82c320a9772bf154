"""Samples taken before the arm stood: every joint still holds the same share of its last move."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Shape, Term
from calibrate.model.effects.time_laws import varies

LIMIT = 0.5


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not varies(drivers.last_move_rad):
        return ()
    return (
        Form(
            Port("time", Place.JOINTS),
            (",".join(f"last_move{i}" for i in range(1, drivers.n_joints + 1)),),
            Shape.LINEAR,
            "not-settled",
            function=_function,
            names=("left_share",),
            limit=LIMIT,
            sentence="At the sample {left_share} of the last move was still to come: the arm had not settled",
        ),
    )


def _function(drivers: Drivers, inner: Floats) -> Floats:
    return -drivers.last_move_rad[:, :, None]


EFFECT = Kind(
    "not-settled",
    "A servo approaches its target exponentially; read too early, a fixed share of the move is missing.",
    ("reading-lag", "backlash"),
    "first-order settling, exp(-t / tau) of the step",
    _terms,
)
