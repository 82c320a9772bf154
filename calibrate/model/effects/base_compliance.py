"""Soft pedestal: the base tilts under the arm's overturning moment."""

from collections.abc import Sequence

import numpy as np

from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.gravity import overturning_by
from calibrate.model.effects.kind import Kind
from calibrate.model.effects.loads import Load, states_masses
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Floats, Missing, Shape, Term
from calibrate.model.effects.weighed import (
    Weighed,
    by_corrected,
    by_stated,
    by_unknown,
    soft,
)

LIMIT_RAD_NM = 1e-3
LIMIT_RAD = 2e-2  # of the tilt, where masses are not known
TILT = Port("base.pose", Place.SURROUNDINGS), ("overturning_moment",), Shape.LINEAR, "base-compliance"
STATED = "The base tilts by {compliance_rad_nm} of overturning moment: soft pedestal"
EACH_WAY = "The base tilts by {compliance_x_rad_nm} about x, {compliance_y_rad_nm} about y: soft pedestal"
UNKNOWN = "The base tilts under the arm ({combination1_rad} rms): soft pedestal; masses are not known"


def _terms(drivers: Drivers) -> tuple[Term, ...]:
    if not states_masses(drivers.rig):
        unknown = by_unknown(drivers, tilted, 1)
        return () if unknown is None else (soft(TILT, unknown, LIMIT_RAD, UNKNOWN),)
    plain, corrected = by_stated(tilted), by_corrected(drivers, tilted)
    terms = [soft(TILT, plain, LIMIT_RAD_NM, STATED), soft(TILT, _each_way(plain), LIMIT_RAD_NM, EACH_WAY)]
    return tuple(terms if corrected is None else [*terms, soft(TILT, corrected, LIMIT_RAD_NM, STATED)])


def tilted(drivers: Drivers, loads: Sequence[Load]) -> Floats:
    """(pose, 6, load) turn about the level axes by the overturning moment, for one rad/Nm.

    As the surroundings seen from the base: they turn the other way.
    """
    moments = overturning_by(drivers, loads)
    out = np.zeros((len(moments), 6, moments.shape[2]))
    out[:, 3:5] = -moments[:, :2]
    return out


def _each_way(stated: Weighed) -> Weighed:
    def at(drivers: Drivers) -> Floats:
        tilt = stated.at(drivers)[:, :, 0]
        out = np.zeros((len(tilt), 6, 2))
        out[:, 3, 0], out[:, 4, 1] = tilt[:, 3], tilt[:, 4]
        return out

    return Weighed(at, ("compliance_x_rad_nm", "compliance_y_rad_nm"), "each way its own")


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
