"""What a joint yields to the payload, over and above the arm's own weight."""

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import payload_levers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Floats, Form, Missing, Shape, Term, at_joint
from calibrate.model.effects.time_laws import varies

LIMIT = 5e-3  # rad per kg, and per kg m
UNKNOWN_CENTRE = "unknown centre"  # variant that finds the first moment of the payload


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if drivers.payload_kg is None or not varies(drivers.payload_kg):
        return ()
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        out.append(_term(drivers, joint, drivers.payload_kg, 1))
        if payload_levers(drivers, joint).shape[1] > 1:
            out.append(_term(drivers, joint, drivers.payload_kg, 4))
    return tuple(out)


def _term(drivers: Drivers, joint: int, payload_kg: Floats, columns: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        carried_kg = payload_kg if drivers.payload_kg is None else drivers.payload_kg  # of the poses asked for
        return carried_kg[:, None] * payload_levers(drivers, joint)[:, :columns]

    names = ("compliance_rad_nm", *(f"moment_{a}_rad_nm" for a in "xyz"))[:columns]
    return Form(
        port,
        ("payload",),
        Shape.LINEAR,
        "payload-compliance",
        variant="" if columns == 1 else UNKNOWN_CENTRE,
        function=function,
        names=names,
        limit=LIMIT,
        sentence=f"Joint {joint} yields {{compliance_rad_nm}} to the payload",
        directions=direction,
        believable=lambda coefficients, inner: bool(coefficients[0] >= 0.0),  # a spring gives way along the load
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return () if drivers.payload_kg is not None else (Missing("payload", "payload_kg", "payload-compliance"),)


EFFECT = Kind(
    "payload-compliance",
    "A load at the flange turns every joint by its lever over the joint's stiffness.",
    ("joint-compliance",),
    "as joint-compliance, with the first moment of the payload unknown where its centre is not stated",
    _terms,
    _missing,
)
