"""A gas spring that carries the upper arm pulls harder when its gas is warm or freshly filled.

The rig logs its pressure as an extra column `balancer_pa`; this effect gives that column a meaning at joint 2.
"""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Floats, Form, Missing, Shape, Term, at_joint
from calibrate.model.effects.time_laws import varies

COLUMN = "balancer_pa"
JOINT = 2
USUAL_PA = 1e6  # columns are for a change of 1 MPa
LIMIT_RAD = 5e-3  # what a joint of a machine that works may give for 1 MPa


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    """Only where the pressure was recorded and changed: a constant pull is part of gravity."""
    if COLUMN not in drivers.extra or not varies(drivers.extra[COLUMN]):
        return ()
    port, direction = at_joint(JOINT, drivers.n_joints)
    return (
        Form(
            port,
            (COLUMN, f"q{JOINT}"),
            Shape.PRODUCT,
            "balancer-pull",
            function=_pull,
            names=("give_level_rad", "give_upright_rad"),
            limit=LIMIT_RAD,
            sentence=f"Joint {JOINT} gives way to its gas spring, for 1 MPa by {{give_level_rad}} with the arm level "
            "and {give_upright_rad} upright",
            directions=direction,
        ),
    )


def _pull(drivers: Drivers, inner: Floats) -> Floats:
    """(pose, 2): pressure over its mean, times the lever of a cylinder hung between two points of unknown place."""
    pressure = drivers.extra[COLUMN]
    q_rad = drivers.q_rad[:, JOINT - 1]
    return ((pressure - pressure.mean()) / USUAL_PA)[:, None] * np.stack([np.cos(q_rad), np.sin(q_rad)], axis=1)


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return () if COLUMN in drivers.extra else (Missing(COLUMN, COLUMN, "balancer-pull"),)


EFFECT = Kind(
    "balancer-pull",
    "A gas spring's torque is pressure times piston times lever; the joint's gear gives way to it.",
    ("joint-compliance",),
    "torque of a cylinder between two points: lever follows the sine of the angle between them",
    _terms,
    _missing,
)
