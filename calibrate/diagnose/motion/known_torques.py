"""Effects of a model or a simulation at the torques of a motion, as terms of the catalogue."""

from collections.abc import Sequence

import numpy as np

from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.term import Accepted, Term
from calibrate.model.effects.torque import MotionDrivers, torque_terms


def listed_torques(effects: Sequence[EffectRecord], drivers: MotionDrivers) -> tuple[Accepted, ...]:
    """Each with its term; one that this motion has no place for (ripple of a joint that stands) is left out.

    DataError where the numbers of an effect do not fit its form.
    """
    terms = torque_terms(drivers)
    return tuple(_accepted(one, term) for one in effects for term in terms if _is(one, term))


def _is(effect: EffectRecord, term: Term) -> bool:
    return (effect.where, effect.physics, effect.order) == (term.port.where, term.physics, term.order)


def _accepted(effect: EffectRecord, term: Term) -> Accepted:
    inner = [effect.inner.get(one.name) for one in term.inner]
    known = [one for one in inner if one is not None]
    if len(known) < len(inner):
        raise DataError(f"effect {effect.name}: inner values are missing; diagnose the recording again")
    return Accepted(term, np.array(list(effect.coefficients.values()), dtype=float), np.array(known, dtype=float))
