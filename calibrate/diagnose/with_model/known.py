"""What a known model contributes to a recording before a diagnosis: where the diagnosis begins.

On the recording that the model was made from, its structure is fitted again (its covariance is of these very readings,
and would count them twice). On any other one its values enter with their covariance as a prior, except for what belongs
to a session: where the device stands, and effects that hold for that session only.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.diagnose import limits
from calibrate.diagnose.state.assumed import Assumed, Stated
from calibrate.diagnose.state.fitted import (
    Fitted,
    fit_from_model,
    fit_geometry,
    given,
)
from calibrate.diagnose.state.session import Session
from calibrate.errors import DataError
from calibrate.fit.identify.session import about_of
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.conditions import moves_of
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.moved import RECORDING
from calibrate.model.effects.term import Accepted, Shape
from calibrate.model.model_file import Covariance, ModelFile
from calibrate.model.parameters import plausible_sizes
from calibrate.model.predict import Predictor
from calibrate.model.sensors import seat
from calibrate.model.with_effects.acting import Acting, listed
from calibrate.model.with_effects.applied import BY_JOINT, effects_at

Floats = NDArray[np.float64]

ANEW = ("device.", "camera.", "marker.", "encoder")  # set up or found again for each recording: nothing is known of it
FOUND = ("tool", seat.POINTS)  # corrections about points that were found in closed form, in `about` of the model
AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Known:
    """A model before a recording."""

    model: ModelFile
    same_recording: bool

    @property
    def effects(self) -> tuple[EffectRecord, ...]:
        """Those that enter."""
        if self.same_recording:
            return tuple(e for e in self.model.effects if not e.after)
        return tuple(e for e in self.model.effects if e.holds == "always")

    def begin(self, session: Session) -> Fitted:
        """The fit beside which something new is sought. DataError where an effect cannot be evaluated."""
        if self.same_recording:
            return given(with_structure(self.effects, session)[1])
        return _later(self.model, session)


def known_before(model: ModelFile, samples: Samples) -> Known:
    """`samples`: all of the recording. DataError where a later recording is asked of a model without a covariance."""
    same = model.made_of(samples) is not False
    if not same and model.covariance is None:
        raise DataError(
            "the model has no covariance, so it is not known what would have changed; diagnose its recording again "
            "(calibeam diagnose --model-out)"
        )
    return Known(model, same)


def with_structure(effects: tuple[EffectRecord, ...], session: Session) -> tuple[Fitted, Fitted]:
    """Geometry alone, and geometry with these effects, both fitted to a recording again.

    DataError where an effect needs what the recording does not hold.
    """
    geometry = fit_geometry(session)
    terms = tuple(term_of(effect, geometry.drivers) for effect in effects)
    return geometry, geometry.refitted(terms) if terms else geometry


def term_of(effect: EffectRecord, drivers: Drivers) -> Accepted:
    """Of the catalogue, as these drivers allow it, with the values of the model to start from.

    DataError where the recording does not hold what the effect needs.
    """
    (carried,) = listed([effect], drivers)
    accepted = carried.accepted
    basis = accepted.term.basis(drivers, accepted.inner)
    if not np.any(basis):
        raise DataError(
            f"effect {effect.name}: {effect.depends_on} never changes in this recording, so its size cannot be refitted"
        )
    columns = basis.shape[-1]
    if columns != len(accepted.coefficients):  # directions of unknown masses are chosen by the poses
        return replace(accepted, coefficients=np.zeros(columns))
    return accepted


def _later(model: ModelFile, session: Session) -> Fitted:
    """The model's values with their covariance as prior, and its effects as it states them."""
    if model.covariance is None:
        raise ValueError("a model without a covariance states nothing of another recording")
    geometry = fit_geometry(session)

    def found_at(samples: Samples) -> tuple[Acting, ...]:
        return effects_at(model, Predictor.of(model), _with_moves(samples), same_session=False).found

    acting_here = found_at(session.samples)
    names = [p.name for p in session.parameters] + [name for one in acting_here for name in one.names]
    mine = {p.name for p in session.parameters if p.free and not p.name.startswith(ANEW)}
    mine |= set(names[len(session.parameters) :])
    known = [name for name in model.covariance.names if name in mine]
    terms = tuple(_stated(one, k, found_at) for k, one in enumerate(acting_here))
    start = np.concatenate([_values(model, session, geometry), *(t.coefficients for t in terms)])
    at = np.array([names.index(name) for name in known], dtype=np.intp)
    covariance = _part(model.covariance, known)
    scale = np.concatenate([plausible_sizes(session.parameters), np.zeros(len(names) - len(session.parameters))])[at]
    scale = np.where(scale > 0.0, scale, np.sqrt(np.diag(covariance)))
    with_known = replace(session, stated=frozenset(known))
    own = at < len(session.parameters)
    unit = np.where(own, np.minimum(scale, limits.STRAIGHT), limits.LOOSE * np.sqrt(np.diag(covariance)))
    return fit_from_model(with_known, geometry, terms, Assumed.of(at, start[at], covariance, scale), start, unit)


def _values(model: ModelFile, session: Session, geometry: Fitted) -> Floats:
    """(param,) the model's, about the points that this session starts from; what it does not know as just fitted."""
    here, values = about_of(session.weighting), geometry.geometry.copy()
    for i, p in enumerate(session.parameters):
        if p.free and p.name in model.chain and not p.name.startswith(ANEW):
            values[i] = model.chain[p.name] + _apart(p.name, model.about, here)
    return values


def _apart(name: str, then: dict[str, tuple[float, ...]], now: dict[str, tuple[float, ...]]) -> float:
    """Of a correction about a point: how far the point of the model is from that of the session."""
    what, _, axis = name.partition(".")
    if not what.startswith(FOUND) or axis not in AXES or what not in then or what not in now:
        return 0.0
    return then[what][AXES.index(axis)] - now[what][AXES.index(axis)]


def _stated(one: Acting, k: int, found_at: Callable[[Samples], tuple[Acting, ...]]) -> Accepted:
    """Number `k` of those that are found at the rows of any samples."""

    def at_samples(samples: Samples) -> tuple[Floats, Floats]:
        there = found_at(samples)[k]
        return there.by_value, there.amount

    accepted = one.carried.accepted
    term, values = accepted.term, accepted.values
    stated = Stated(
        term.port,
        (RECORDING,),
        Shape.CONSTANT,
        term.physics,
        variant=one.carried.record.name,
        columns=one.by_value,
        added=one.amount,
        about=values,
        at_samples=at_samples,
    )
    return Accepted(stated, values, np.zeros(0))


def _part(covariance: Covariance, names: list[str]) -> Floats:
    """(name, name)"""
    rows = [covariance.names.index(name) for name in names]
    return np.array(covariance.rows, dtype=np.float64)[np.ix_(rows, rows)]


def _with_moves(samples: Samples) -> Samples:
    """With approach and last move by the order in time, where no column holds them."""
    moves, direction = moves_of(samples)
    derived = {"last_move": moves, "approach": direction}
    columns = {BY_JOINT[k].format(i + 1): v[:, i] for k, v in derived.items() for i in range(samples.n_joints)}
    return Samples(columns | dict(samples.columns), samples.n_joints)
