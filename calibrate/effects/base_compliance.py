"""Soft pedestal: the base tilts under the arm's overturning moment."""

from collections.abc import Callable, Sequence

import numpy as np

from calibrate.effects.drivers import Drivers
from calibrate.effects.form import Believable, Floats, Form
from calibrate.effects.gravity import overturning_by
from calibrate.effects.kind import Kind
from calibrate.effects.loads import Load, states_masses
from calibrate.effects.ports import Place, Port
from calibrate.effects.term import Missing, Shape, Term
from calibrate.effects.weighed import Weighed, by_corrected, by_stated, by_unknown, yields

LIMIT_RAD_NM = 1e-3
LIMIT_RAD = 2e-2  # of the tilt, where masses are not known


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not states_masses(drivers.rig):
        unknown = by_unknown(drivers, tilted, 1)
        return () if unknown is None else (_unknown_masses(unknown),)
    plain, corrected = by_stated(tilted), by_corrected(drivers, tilted)
    terms = [_stated(plain, ""), _each_way(plain)]
    return tuple(terms if corrected is None else [*terms, _stated(corrected, "masses corrected")])


def tilted(drivers: Drivers, loads: Sequence[Load]) -> Floats:
    """(pose, 6, load) turn about the level axes by the overturning moment, for one rad/Nm.

    As the surroundings seen from the base: they turn the other way.
    """
    moments = overturning_by(drivers, loads)
    out = np.zeros((len(moments), 6, moments.shape[2]))
    out[:, 3:5] = -moments[:, :2]
    return out


def _stated(weighed: Weighed, variant: str) -> Term:
    return _term(
        lambda drivers, inner: weighed.at(drivers),
        variant,
        ("compliance_rad_nm", *(f"mass_correction{k}_rad_nm" for k in range(1, weighed.columns))),
        "The base tilts by {compliance_rad_nm} of overturning moment: soft pedestal",
        lambda coefficients, inner: yields(coefficients, weighed.corrections),
    )


def _each_way(weighed: Weighed) -> Term:
    def function(drivers: Drivers, inner: Floats) -> Floats:
        tilt = weighed.at(drivers)[:, :, 0]
        out = np.zeros((len(tilt), 6, 2))
        out[:, 3, 0], out[:, 4, 1] = tilt[:, 3], tilt[:, 4]
        return out

    return _term(
        function,
        "each way its own",
        ("compliance_x_rad_nm", "compliance_y_rad_nm"),
        "The base tilts by {compliance_x_rad_nm} about x, {compliance_y_rad_nm} about y: soft pedestal",
        lambda coefficients, inner: yields(coefficients),
    )


def _unknown_masses(weighed: Weighed) -> Term:
    return _term(
        lambda drivers, inner: weighed.at(drivers),
        "unknown masses",
        weighed.names("compliance_rad_nm"),
        "The base tilts under the arm ({combination1_rad} rms): soft pedestal; masses are not known",
        weighed.believable,
        LIMIT_RAD,
    )


def _term(
    function: Callable[[Drivers, Floats], Floats],
    variant: str,
    names: tuple[str, ...],
    sentence: str,
    believable: Believable,
    limit: float = LIMIT_RAD_NM,
) -> Term:
    return Form(
        Port("base.pose", Place.SURROUNDINGS),
        ("overturning_moment",),
        Shape.LINEAR,
        "base-compliance",
        variant=variant,
        function=function,
        names=names,
        limit=limit,
        sentence=sentence,
        believable=believable,
    )


def _missing(drivers: Drivers) -> tuple[Missing, ...]:
    if states_masses(drivers.rig):
        return ()
    return (Missing("overturning_moment", "arm.joint.mass_kg and com_m in the rig", "base-compliance"),)


EFFECT = Kind(
    "base-compliance",
    "A pedestal or floor bends under the moment of an outstretched arm.",
    ("joint-compliance",),
    "rotation = moment / stiffness about the horizontal axes of the base",
    _terms,
    _missing,
)
