"""Clocks apart: readings belong to another moment than the joint angles beside them."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Form, Missing, Shape, Term
from calibrate.model.effects.time_laws import varies

LIMIT_S = 0.5


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if drivers.qd_rad_s is None or not varies(drivers.qd_rad_s):
        return ()
    names = ",".join(f"qd{i}" for i in range(1, drivers.n_joints + 1))
    return (
        Form(
            Port("time", Place.JOINTS),
            (names,),
            Shape.LINEAR,
            "latency",
            function=_function,
            names=("delay_s",),
            limit=LIMIT_S,
            sentence="The instrument reads {delay_s} later than the joints it is paired with",
        ),
    )


def _function(drivers: Drivers, inner: Floats) -> Floats:
    speed = drivers.qd_rad_s
    return np.zeros((*drivers.q_rad.shape, 1)) if speed is None else speed[:, :, None]


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return () if drivers.qd_rad_s is not None else (Missing("qd", "qd1_rad_s ...", "latency"),)


EFFECT = Kind(
    "latency",
    "Two devices stamp their readings by clocks apart or after different delays; a moving arm shows it.",
    ("reading-lag", "backlash"),
    "mismatch catalogue: dt times joint speed, one dt for all joints",
    _terms,
    _missing,
)
