"""Coupled wrist: turning one joint drags another along."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Floats, Form, Shape, Term, at_joint

LIMIT_RAD_PER_RAD = 0.2
REACH = 2  # joints away: nested wrist shafts


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    n = drivers.n_joints
    return tuple(
        _term(drivers, joint, other)
        for joint in range(1, n + 1)
        for other in range(1, n + 1)
        if 0 < abs(joint - other) <= REACH and (other < joint or abs(joint - other) == 1)
    )


def _term(drivers: Drivers, joint: int, other: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        return drivers.q_rad[:, other - 1 : other]

    return Form(
        port,
        (f"q{other}",),
        Shape.LINEAR,
        "joint-coupling",
        function=function,
        names=("coupling_rad_per_rad",),
        limit=LIMIT_RAD_PER_RAD,
        sentence=f"Joint {joint} turns by {{coupling_rad_per_rad}} of joint {other}: coupled drives",
        directions=direction,
    )


EFFECT = Kind(
    "joint-coupling",
    "Shafts that run through one another, or a belt over two axes, turn a joint when its neighbour turns.",
    ("axis-wobble", "encoder-eccentricity"),
    "Whitney, Lozinski, Rourke, Industrial robot forward calibration method and results, J. Dyn. Sys. Meas. Control "
    "108(1), 1986 (wrist coupling)",
    _terms,
)
