"""Soft pedestal: the base tilts under the arm's overturning moment."""

import numpy as np

from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Floats, Form
from calibrate.effects.gravity import overturning_nm
from calibrate.effects.kind import Kind
from calibrate.effects.ports import Place, Port
from calibrate.effects.term import Shape, Term

LIMIT_RAD_NM = 1e-3


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    return (_term(1), _term(2))


def _term(stiffnesses: int) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        moment = overturning_nm(drivers)
        out = np.zeros((len(moment), 6, 2))
        out[:, 3, 0], out[:, 4, 1] = moment[:, 0], moment[:, 1]
        return out if stiffnesses == 2 else out.sum(axis=2, keepdims=True)

    return Form(
        Port("base.pose", Place.FRAME, 0),
        ("overturning_moment",),
        Shape.LINEAR,
        "base-compliance",
        variant="" if stiffnesses == 1 else "each way its own",
        function=function,
        names=("compliance_rad_nm",) if stiffnesses == 1 else ("compliance_x_rad_nm", "compliance_y_rad_nm"),
        limit=LIMIT_RAD_NM,
        sentence="The base tilts by {compliance_rad_nm} of overturning moment: soft pedestal"
        if stiffnesses == 1
        else "The base tilts by {compliance_x_rad_nm} about x, {compliance_y_rad_nm} about y: soft pedestal",
    )


EFFECT = Kind(
    "base-compliance",
    "A pedestal or floor bends under the moment of an outstretched arm.",
    ("joint-compliance",),
    "rotation = moment / stiffness about the horizontal axes of the base",
    _terms,
)
