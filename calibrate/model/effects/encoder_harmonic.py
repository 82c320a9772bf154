"""Harmonics of two to four a turn: oval ring, two reading heads, wave generator of a harmonic drive."""

import numpy as np
from numpy.typing import NDArray

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import Form, Shape, Term, at_joint

Floats = NDArray[np.float64]
ORDERS = (2, 3, 4)
LIMIT_RAD = 2e-3


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    return tuple(_term(drivers, joint, order) for joint in range(1, drivers.n_joints + 1) for order in ORDERS)


def _term(drivers: Drivers, joint: int, order: int) -> Term:
    port, direction = at_joint(joint, drivers.n_joints)

    def function(drivers: Drivers, inner: Floats) -> Floats:
        angle = order * drivers.q_rad[:, joint - 1]
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)

    return Form(
        port,
        (f"q{joint}",),
        Shape.HARMONIC,
        "encoder-harmonic",
        order,
        function=function,
        names=("amplitude_rad", "phase_rad"),
        limit=LIMIT_RAD,
        sentence=f"Joint {joint} reads off by up to {{amplitude_rad}} {order} times a turn: oval ring or scale",
        directions=direction,
        polar=True,
    )


EFFECT = Kind(
    "encoder-harmonic",
    "A graduation ring pressed oval, or a second reading head, repeats its error several times a turn.",
    ("gear-transmission-error", "unknown"),
    "mismatch catalogue: ovality h2, h3; Sanchez-Brea, Morlanes, Meas. Sci. Technol. 19, 2008",
    _terms,
)
