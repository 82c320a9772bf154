"""Worn bearing: the axis of a joint tilts as it turns."""

import numpy as np

from calibrate.model.effects.drivers import Drivers, beyond_end_m
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Shape, Term

# Cycles in the frame that does not turn; negative turns against the joint. +1 turns with it and is geometry.
ORDERS = (-1, 2, -2, 3, -3)
LIMIT_RAD = 2e-3


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    return tuple(_term(joint, order) for joint in range(1, drivers.n_joints + 1) for order in ORDERS)


def _term(joint: int, order: int) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        angle = order * drivers.q_rad[:, joint - 1]
        out = np.zeros((len(angle), 6, 2))
        out[:, 3, 0], out[:, 4, 0] = -np.sin(angle), np.cos(angle)
        out[:, 3, 1], out[:, 4, 1] = np.cos(angle), np.sin(angle)
        # The bearing sits where the link starts, which need not be the frame's origin.
        out[:, :3] = np.cross(out[:, 3:], [0.0, 0.0, beyond_end_m(drivers, joint - 1)], axisa=1, axisc=1)
        return out

    return Form(
        Port(f"link{joint}.tilt", Place.FRAME, joint - 1),
        (f"q{joint}",),
        Shape.HARMONIC,
        "axis-wobble",
        abs(order),
        variant="with the joint" if order > 0 else "against the joint",
        function=function,
        names=("amplitude_rad", "phase_rad"),
        limit=LIMIT_RAD,
        sentence=f"The axis of joint {joint} tilts by {{amplitude_rad}}, {abs(order)} times a turn: worn bearing",
        polar=True,
    )


EFFECT = Kind(
    "axis-wobble",
    "Balls or races that are not round tilt the axis while it turns.",
    ("encoder-eccentricity", "encoder-harmonic"),
    "tilt error motion of an axis of rotation: ISO 230-7:2015, 3.3; once a turn with the joint it is geometry",
    _terms,
)
