"""A joint's reading is behind: it still holds part of the last move, or part of what the controller is asking for."""

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.term import (
    Floats,
    Form,
    Functions,
    Missing,
    Shape,
    Term,
    at_joint,
)
from calibrate.model.effects.time_laws import varies

LIMIT = 1.5  # of the difference


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    out: list[Term] = []
    for joint in range(1, drivers.n_joints + 1):
        if varies(drivers.last_move_rad[:, joint - 1]):
            out.append(_of_last_move(drivers, joint))
        apart = drivers.cmd_minus_q_rad
        if apart is not None and varies(apart[:, joint - 1]):
            out.append(_of_command(drivers, joint))
    return tuple(out)


def _of_last_move(drivers: Drivers, joint: int) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        return -drivers.last_move_rad[:, joint - 1 : joint]

    short, ahead = f"Joint {joint} stops short by", f"The reading of joint {joint} is behind the joint by"
    return _term(drivers, joint, f"last_move{joint}", (short, ahead), "of its last move", function)


def _of_command(drivers: Drivers, joint: int) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        apart = drivers.cmd_minus_q_rad
        return np.zeros((len(drivers.q_rad), 1)) if apart is None else apart[:, joint - 1 : joint]

    behind, short = f"The reading of joint {joint} is behind the joint by", f"Joint {joint} is behind its reading by"
    return _term(drivers, joint, f"cmd_minus_q{joint}", (behind, short), "of what it was still asked to go", function)


def _term(drivers: Drivers, joint: int, driver: str, begins: tuple[str, str], ends: str, function: Functions) -> Term:
    """`begins` of the sentence for a share above and below zero."""
    port, direction = at_joint(joint, drivers.n_joints)
    return Form(
        port,
        (driver,),
        Shape.LINEAR,
        "reading-lag",
        function=function,
        names=("lag_share",),
        limit=LIMIT,
        sentence=f"{begins[0]} {{lag_share}} {ends}",
        reversed_sentence=f"{begins[1]} {{lag_share}} {ends}",
        directions=direction,
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    return () if drivers.cmd_minus_q_rad is not None else (Missing("cmd_minus_q", "cmd1_rad ...", "reading-lag"),)


EFFECT = Kind(
    "reading-lag",
    "The logged angle is older than the pose, or the joint had not arrived when it was read.",
    ("backlash", "not-settled"),
    "mismatch catalogue: c times the last move, or commanded minus measured",
    _terms,
    _missing,
)
