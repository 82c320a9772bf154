"""Effects of a model or a simulation at the torques of a motion, as terms of the catalogue."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calibrate.errors import DataError
from calibrate.model.effect_records import EffectCurve, EffectRecord
from calibrate.model.effects.curve import TORQUE, UNKNOWN, cause
from calibrate.model.effects.term import Accepted, Shape, Term
from calibrate.model.effects.torque import MotionDrivers, torque_terms
from calibrate.model.effects.torque.motion_drivers import at_torque

Floats = NDArray[np.float64]


def listed_torques(effects: Sequence[EffectRecord], drivers: MotionDrivers) -> tuple[Accepted, ...]:
    """Each with its term; one that this motion has no place for (ripple of a joint that stands) is left out.

    DataError where the numbers of an effect do not fit its form.
    """
    terms = torque_terms(drivers)
    listed = [_accepted(one, term) for one in effects for term in terms if _is(one, term)]
    return (*listed, *(_drawn(one, one.curve, drivers.n_joints) for one in effects if one.curve is not None))


def _drawn(effect: EffectRecord, curve: EffectCurve, n: int) -> Accepted:
    """An unknown cause of one driver, through the knots of its curve; beyond them as at the last one."""
    knots, values = np.array(curve.knots), np.array(curve.values)

    def law(d: MotionDrivers, inner: Floats) -> Floats:
        return np.interp(cause(d, curve.driver), knots, values)[:, None]

    joint = int(effect.where.removeprefix("joint").removesuffix(TORQUE))
    term = at_torque(joint, n, UNKNOWN, Shape.LINEAR, (curve.driver,), law, ("share",), np.inf, effect.says)
    return Accepted(term, np.ones(1), np.zeros(0))


def _is(effect: EffectRecord, term: Term) -> bool:
    physics = effect.listed or effect.physics
    return (effect.where, physics, effect.order) == (term.port.where, term.physics, term.order)


def _accepted(effect: EffectRecord, term: Term) -> Accepted:
    inner = [effect.inner.get(one.name) for one in term.inner]
    known = [one for one in inner if one is not None]
    if len(known) < len(inner):
        raise DataError(f"effect {effect.name}: inner values are missing; diagnose the recording again")
    return Accepted(term, np.array(list(effect.coefficients.values()), dtype=float), np.array(known, dtype=float))
