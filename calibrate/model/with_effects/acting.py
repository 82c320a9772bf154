"""Effects of a model at rows that it has not seen: what each adds at its port, and what its coefficients do there.

New rows stand behind those of the session that the effects were found in (model/with_effects/applied.py), so that
means, knots and largest torques are those of the session, and a coefficient keeps its meaning.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model.arms.coupled_readings import by_reading, recoupled
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.catalogue import EFFECTS
from calibrate.model.effects.conditions import conditions_of, temperatures_of
from calibrate.model.effects.curve import cause, curve
from calibrate.model.effects.drivers import Drivers, Readout
from calibrate.model.effects.gravity import likely_torque_nm
from calibrate.model.effects.ports import Perturbation, Place, Port
from calibrate.model.effects.second_encoders import SECOND, at_second_encoders
from calibrate.model.effects.term import Accepted, Form, Shape, Term
from calibrate.model.predict import Predictor, readings
from calibrate.model.sensors.catalogue import kind_of
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE
from calibrate.model.with_effects.driver_values import readout_at
from calibrate.model.with_effects.new_poses import rearranged, with_meaning
from calibrate.model.with_effects.ported_chain import perturbed_frames

Floats = NDArray[np.float64]

TURNS = 3  # drivers follow the frames that the effects have moved; each turn leaves a thousandth of a change
SAME = 1e-6  # of a basis: then the exact formula has the same meaning as in the session
UNIFORM = np.sqrt(3.0)  # half the width of a uniform law over its standard deviation


@dataclass(frozen=True, eq=False)
class Carried:
    """An effect of the file with its term of the catalogue."""

    record: EffectRecord
    accepted: Accepted

    @property
    def drivers(self) -> tuple[str, ...]:
        return tuple(self.record.depends_on.split(","))


@dataclass(frozen=True, eq=False)
class Acting:
    """One effect at the rows asked for."""

    carried: Carried
    amount: Floats  # (row, width)
    by_value: Floats  # (row, width, coefficients and smooth inner values)
    outside: NDArray[np.bool_]  # (row,) beyond the recorded range: an unknown cause ends at what was last recorded
    spread: Floats  # (width, width) of the amount over the session: uncertainty where it is not known
    undated: Floats  # (row, width) one sigma between the recorded rows that a step lies between: before it or after?

    @property
    def port(self) -> Port:
        return self.carried.accepted.term.port

    @property
    def added(self) -> tuple[Port, Floats]:
        return self.port, self.amount

    @property
    def names(self) -> list[str]:
        """Of the values of `by_value`, as in the covariance of the model."""
        effect, term = self.carried.record, self.carried.accepted.term
        return [*effect.coefficients, *(f"{effect.name}.{term.inner[j].name}" for j in term.smooth)]


def listed(effects: Sequence[EffectRecord], drivers: Drivers) -> tuple[Carried, ...]:
    """Each effect with its term. DataError for one that the catalogue does not list for this session."""
    wanted = {effect.listed or effect.physics for effect in effects}
    derived = any(effect.shape == Shape.HYSTERESIS.value for effect in effects)  # the file holds it as a column
    drivers = replace(drivers, approach_derived=derived)
    terms = [t for e in EFFECTS if e.physics in wanted for t in e.terms(drivers)]
    terms += at_second_encoders(terms, drivers)
    return tuple(Carried(effect, _accepted(effect, _term(effect, terms, drivers))) for effect in effects)


def frames_under(predictor: Predictor, q_rad: Floats, by: Perturbation) -> Floats:
    """(row, joint + 1, 4, 4)"""
    theta = predictor.values_of(predictor.arm.parameters)
    return perturbed_frames(predictor.arm, theta, predictor.at_shafts(q_rad), by)


def drivers_under(predictor: Predictor, samples: Samples, by: Perturbation) -> Drivers:
    """At all rows, as the model predicts them under a perturbation.

    Joints of the samples are counted from the link in front, as a model keeps the conditions of its session.
    """
    matrix = by_reading(predictor.rig.arm)
    frames = frames_under(predictor, recoupled(matrix, samples.joints()), by)
    place = {f"temp_{k}_degC": k for k in temperatures_of(samples)}
    as_recorded = {k: samples.column(c) for c, k in place.items()}  # smoothed already
    taken, readouts = conditions_of(samples, as_recorded), _readouts(predictor, samples, frames, by)
    return Drivers(**vars(taken), rig=predictor.rig, frames=frames, readouts=readouts)


def acting(carried: Sequence[Carried], predictor: Predictor, recorded: Samples, both: Samples) -> tuple[Acting, ...]:
    """At the rows of `both` behind the `recorded` ones."""
    n, joints = len(recorded), both.n_joints
    by_old, by_new = Perturbation.none(n, joints), Perturbation.none(len(both), joints)
    out: tuple[Acting, ...] = ()
    for _ in range(TURNS):
        old = drivers_under(predictor, recorded, by_old)
        new = replace(drivers_under(predictor, both, by_new), session_rows=n)
        amounts = [_amount(c, old) for c in carried]
        out = tuple(_acting(c, old, new, amount) for c, amount in zip(carried, amounts, strict=True))
        of_session = [(one.port, amount) for one, amount in zip(out, amounts, strict=True)]
        of_both = [(one.port, np.concatenate([was, one.amount])) for one, was in zip(out, amounts, strict=True)]
        by_old, by_new = Perturbation.of_all(n, joints, of_session), Perturbation.of_all(len(both), joints, of_both)
    return out


def range_of(drivers: Drivers, name: str) -> Floats | None:
    """(row,) of a driver that is one number a row; None for others."""
    stem = name.rstrip("0123456789")
    if stem == "gravity_torque" and name != stem:
        return likely_torque_nm(drivers, int(name[len(stem) :]))
    try:
        return cause(drivers, name)
    except KeyError:
        return None


def _term(effect: EffectRecord, terms: Sequence[Term], drivers: Drivers) -> Term:
    if effect.waves is not None and effect.component is not None:
        port = _port_of(effect, drivers)
        return curve(port, effect.component, tuple(effect.depends_on.split(",")), effect.waves)
    physics = effect.listed or effect.physics
    key = (effect.where, effect.depends_on, effect.shape, effect.order, physics, effect.variant)
    for term in terms:
        if (term.port.where, ",".join(term.depends_on), *term.key[2:]) == key:
            return term
    raise DataError(
        f"effect {effect.name}: no {physics} at {effect.where} by {effect.depends_on} ({effect.shape}) under the "
        "conditions of its session; diagnose the recording again with this version"
    )


def _port_of(effect: EffectRecord, drivers: Drivers) -> Port:
    """Where a curve acts. A tilt of link 1 in front of its joint and one behind it have the same name, so that a file
    without `place` states where only if one port has that name.
    """
    if effect.variant == SECOND:
        return Port(effect.where, Place.READING, instrument=ENCODER_DIFFERENCE)
    ports = {t.port for e in EFFECTS for t in e.terms(drivers) if t.port.where == effect.where}
    ports = {p for p in ports if not p.past_encoders and _is_at(effect, p)}
    if len(ports) == 1:
        return ports.pop()
    why = "several places have this name" if ports else "nothing can act there in this session"
    raise DataError(f"effect {effect.name} at {effect.where}: {why}; diagnose the recording again")


def _is_at(effect: EffectRecord, port: Port) -> bool:
    of_frame = port.place is not Place.FRAME or effect.frame == port.index
    return not effect.place or (port.place.value == effect.place and of_frame)


def _accepted(effect: EffectRecord, term: Term) -> Accepted:
    coefficients = np.array(list(effect.coefficients.values()), dtype=np.float64)
    missing = [spec.name for spec in term.inner if spec.name not in effect.inner]
    if missing:
        raise DataError(f"effect {effect.name}: inner.{missing[0]} is missing; diagnose the recording again")
    return Accepted(term, coefficients, np.array([effect.inner[spec.name] for spec in term.inner], dtype=np.float64))


def _acting(carried: Carried, old: Drivers, new: Drivers, was: Floats) -> Acting:
    """An unknown cause ends at what was last recorded: rows beyond are taken for the recorded row that is nearest."""
    n, outside = len(old.q_rad), np.zeros(len(new.q_rad) - len(old.q_rad), dtype=bool)
    if carried.accepted.term.open:
        outside, nearest = _beyond(carried, old, new)
        order = np.arange(len(new.q_rad))
        order[n:][outside] = nearest
        new = rearranged(new, order)
    a, (basis, exact) = carried.accepted, _basis(carried, old, new)
    linear = basis @ a.coefficients
    by_inner = a.by_inner(lambda inner: _basis(carried, old, new, inner)[0] @ a.coefficients)
    spread = np.cov(was, rowvar=False).reshape(2 * (was.shape[1],))
    undated = _undated(carried, old, new, linear)
    by_value = np.concatenate([basis, *by_inner], axis=-1)
    return Acting(carried, linear if exact is None else exact, by_value, outside, spread, undated)


def _undated(carried: Carried, old: Drivers, new: Drivers, amount: Floats) -> Floats:
    """(asked, width) of a step that may have been at any time, all alike, between two recorded rows.

    A row at t there is wrong by the whole step with the probability that its time is on the other side of t.
    """
    a, t, out = carried.accepted, new.t_s[len(old.q_rad) :], np.zeros_like(amount)
    for j, spec in enumerate(a.term.inner):
        dated = carried.record.parameters.get(spec.name)
        if not spec.discrete or dated is None or not dated.sigma:
            continue
        half = UNIFORM * dated.sigma
        for end in (-half, half):
            inner = a.inner.copy()
            inner[j] += end * (1.0 - 1e-9)
            wrong = np.clip((t - a.inner[j] - end) / -np.copysign(2.0 * half, end), 0.0, 1.0)
            out += np.sqrt(wrong)[:, None] * (_basis(carried, old, new, inner)[0] @ a.coefficients - amount)
    return out


def _amount(carried: Carried, old: Drivers) -> Floats:
    """(recorded row, width). DataError where the numbers of the file do not fit its form."""
    a = carried.accepted
    columns = a.term.basis(old, a.inner).shape[-1]
    if columns == len(a.coefficients):
        amount = a.term.amount(old, a.coefficients, a.inner)
        if np.all(np.isfinite(amount)):
            return amount
    raise DataError(
        f"effect {carried.record.name}: {len(a.coefficients)} coefficients where its form has {columns}, or "
        "values that no machine has; diagnose the recording again"
    )


def _basis(carried: Carried, old: Drivers, new: Drivers, inner: Floats | None = None) -> tuple[Floats, Floats | None]:
    """(asked, width, coefficient) with the meaning of the session, and the exact amount where the rows behind do not
    change that meaning. DataError where it cannot be kept.
    """
    a, n = carried.accepted, len(old.q_rad)
    values = a.inner if inner is None else inner
    term = a.term
    was, now = term.basis(old, values), _of_both(carried, new, values)
    size = float(np.linalg.norm(was))
    if np.linalg.norm(now[:n] - was) <= SAME * size:
        return now[n:], _exact(term, new, a.coefficients, values, n)
    kept = with_meaning(now, was, a.coefficients)
    if kept is None:
        raise DataError(
            f"effect {carried.record.name}: these samples lie too far from those it was found in; ask for fewer rows, "
            "or for rows within the recorded range"
        )
    return kept, None


def _exact(term: Term, new: Drivers, coefficients: Floats, inner: Floats, n: int) -> Floats | None:
    """(asked, width) by the exact formula, where the term has one that is more than its basis."""
    own = isinstance(term, Form) and term.exact is not None
    return term.amount(new, coefficients, inner)[n:] if own else None


def _of_both(carried: Carried, new: Drivers, values: Floats) -> Floats:
    """Of the term, or of its like in the longer table: some know the rows that they were listed for."""
    term = carried.accepted.term
    try:
        own = term.basis(new, values)
        if len(own) == len(new.q_rad):
            return own
    except ValueError:  # its own rows and the new ones are of different number
        pass
    return listed([carried.record], new)[0].accepted.term.basis(new, values)


def _beyond(carried: Carried, old: Drivers, new: Drivers) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """(asked,) rows beyond the recorded range of an unknown cause, and the recorded row nearest to each of those."""
    n, names = len(old.q_rad), carried.drivers
    pairs = [(range_of(old, name), range_of(new, name)) for name in names]
    known = [(a, b[n:]) for a, b in pairs if a is not None and b is not None]
    if not known:
        return np.zeros(len(new.q_rad) - n, dtype=bool), np.zeros(0, dtype=np.intp)
    a, b = (np.stack([pair[k] for pair in known], axis=1) for k in (0, 1))
    low, high = a.min(axis=0), a.max(axis=0)
    outside = np.any((b < low) | (b > high), axis=1)
    scale = np.maximum(high - low, 1e-300)
    nearest = KDTree(a / scale).query(b[outside] / scale)[1]
    return outside, np.asarray(nearest, dtype=np.intp)


def _readouts(predictor: Predictor, samples: Samples, frames: Floats, by: Perturbation) -> dict[str, Readout]:
    """Of the instruments that the model was fitted to, as predicted without their own errors of reading."""
    kinds = [kind for kind in map(kind_of, predictor.instruments) if kind.reads]
    read = readings(predictor, frames[:, -1], samples, [kind.name for kind in kinds])
    out: dict[str, Readout] = {}
    for kind in kinds:
        table = np.stack([read[c] for c in kind.reads], axis=1)
        if kind.name in by.readings:
            table = table + by.readings[kind.name]
        place = None if kind.place is None else kind.place(samples)
        there = np.isfinite(table).all(axis=1)
        rows = np.flatnonzero(there if place is None else there & (place > 0))
        sensor, phi = (None, np.zeros(0)) if kind.used is None else kind.used(predictor, samples, rows)
        found = readout_at(kind.name, sensor, phi, table[rows], rows, frames)
        out[kind.name] = found if found.place is not None else replace(found, place=place)
    if joints := tuple(i for i in range(1, samples.n_joints + 1) if f"encoder{i}.zero" in predictor.values):
        n = len(frames)  # of use to find where an effect sits; nothing else depends on these readings
        nothing = np.full((n, len(joints)), np.nan)
        out[ENCODER_DIFFERENCE] = Readout(kind_of(ENCODER_DIFFERENCE), nothing, np.zeros(n, dtype=bool), joints=joints)
    return out


def moved_columns(by: Perturbation) -> Mapping[str, Floats]:
    """Column -> (row,) that errors of reading add to what an instrument reads."""
    out: dict[str, Floats] = {}
    for name, amount in by.readings.items():
        for column, values in zip(kind_of(name).reads, amount.T, strict=False):
            out[column] = out.get(column, np.zeros(len(values))) + values
    return out
