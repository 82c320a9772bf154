"""Encoder slip: from some moment on a joint reads off by a fixed angle."""

from calibrate.model.effects import time_laws
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Form, Holds, Shape, Term, at_joint

LIMIT_RAD = 5e-2


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    inner = time_laws.step_inner(drivers)
    if not inner:
        return ()
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        port, direction = at_joint(joint, drivers.n_joints)
        out.append(
            Form(
                port,
                ("t",),
                Shape.STEP,
                "encoder-slip",
                None,
                inner,
                slow=True,
                function=time_laws.step,
                names=("slip_rad",),
                limit=LIMIT_RAD,
                sentence=f"Joint {joint} reads off by {{slip_rad}} from {{time_s}} on: its encoder or coupling slipped",
                directions=direction,
            )
        )
    return tuple(out)


EFFECT = Kind(
    "encoder-slip",
    "A coupling or disc slips once, and from then on every reading is off by the same angle.",
    ("base-moved", "fixture-moved"),
    "mismatch catalogue: encoder jump",
    _terms,
    holds=Holds.SESSION,
)
