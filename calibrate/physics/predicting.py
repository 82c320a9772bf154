"""What a model says the instruments should read with the physics that it carries, and how far that is known.

One sigma of a prediction is that of the covariance of geometry, frames and effects together, mapped through the
readings, and of the conditions that a row lacks; the instrument's own noise is apart.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.columns import required
from acquisition.recording.samples import Samples
from calibrate.effects.ports import Perturbation, Port
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.physics.acting import (
    Acting,
    Carried,
    acting,
    arm_in,
    drivers_under,
    flange_frames,
    listed,
    moved_columns,
    range_of,
)
from calibrate.physics.conditions import Completed, completed, joined, needed_columns
from calibrate.predict import Columns, Predictor, less_cones, readings, residuals

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
At = Callable[[Predictor, Perturbation], Columns]

FEWEST = 2  # rows of a session, to have a spread
STEP = 1e-6  # m, rad or a factor: readings are linear over it, and 1e-10 of a derivative is lost to rounding
BEYOND = 1e-9  # of the recorded range: rounding


@dataclass(frozen=True, eq=False)
class Predicted:
    """`columns` (row,) as in predicted.csv; `outside` names of drivers of each row; `notes` sentences for a person."""

    columns: Columns
    outside: tuple[str, ...]
    notes: tuple[str, ...]


def predict_with_physics(model: ModelFile, samples: Samples, same_session: bool = False) -> Predicted:
    """`same_session`: the rows are of the recording that the effects were found in, whose clock they share.

    DataError for a model without its rig, and for rows at which an effect of the model cannot be evaluated.
    """
    predictor = Predictor.of(model)
    used = [e for e in model.effects if e.holds == "always" or same_session]
    left_out = [f"left out, true of its own session only: {e.name}" for e in model.effects if e not in used]
    nothing = Perturbation.none(len(samples), samples.n_joints)
    if model.session is None or not used:
        columns = _with_sigma(model, predictor, samples, (), (), nothing, samples)
        return Predicted(columns, ("",) * len(samples), tuple(left_out))
    recorded = recorded_samples(model, samples.n_joints)
    carried = listed(used, drivers_under(predictor, recorded, Perturbation.none(len(recorded), samples.n_joints)))
    needs = needed_columns((d for c in carried for d in c.drivers), recorded.names)
    filled = completed(samples, recorded, needs, same_session)
    found = acting(carried, predictor, recorded, joined(recorded, filled.samples))
    by = nothing
    for one in found:
        by = by.plus(one.port, one.amount)
    doubts = [*_of_missing(carried, found, predictor, recorded, filled), *_of_range(found)]
    columns = _with_sigma(model, predictor, samples, found, doubts, by, filled.samples)
    notes = [*left_out, *(_lacks(name, rows, carried) for name, rows in filled.missing.items())]
    both = joined(recorded, filled.samples)
    return Predicted(columns, _outside(carried, predictor, both, len(recorded), filled), tuple(notes))


def recorded_samples(model: ModelFile, n_joints: int) -> Samples:
    """The conditions of the model's session as a table. DataError where a column that every row has is missing."""
    given = {} if model.session is None else model.session.conditions
    table = {c: np.array(values, dtype=np.float64) for c, values in given.items()}
    for name in (*required(n_joints), *model.needs):
        values = table.get(name, np.zeros(0))
        if (
            len(values) < FEWEST
            or not np.isfinite(values).any()
            or (name not in model.needs and np.isnan(values).any())
        ):
            raise DataError(f"session.conditions.{name}: missing or empty; diagnose the recording again")
    return Samples(table, n_joints)


def _with_sigma(
    model: ModelFile,
    predictor: Predictor,
    samples: Samples,
    found: Sequence[Acting],
    doubts: Sequence[tuple[Port, Floats]],
    by: Perturbation,
    filled: Samples,
) -> Columns:
    """t_s, predicted columns, `s_...`, `r_...`."""
    arm, q = arm_in(predictor), samples.joints()

    def reading(predictor: Predictor, by: Perturbation) -> Columns:
        frames = flange_frames(arm, predictor, q, by)[:, -1] if found else predictor.flange(q)
        read, moved = readings(predictor, frames, samples), moved_columns(by)
        return {c: v + moved[c] if c in moved else v for c, v in read.items()}

    def at(predictor: Predictor, by: Perturbation) -> Columns:
        """A tip in a cone that the model knows is told from the cone: where both stand in the base, nobody sees."""
        read = reading(predictor, by)
        return less_cones(predictor, read, samples)

    read = reading(predictor, by)
    variance = _of_values(model, predictor, found, by, at, tuple(read))
    for port, amount in doubts:
        for c, felt in _felt(at, predictor, by, port, amount).items():
            variance[c] += felt**2
    sigma = {f"s_{c}": np.where(np.isfinite(read[c]), np.sqrt(np.maximum(v, 0.0)), np.nan) for c, v in variance.items()}
    return {"t_s": samples.column("t_s")} | read | sigma | residuals(predictor, read, samples)


def _of_values(
    model: ModelFile, predictor: Predictor, found: Sequence[Acting], by: Perturbation, at: At, columns: tuple[str, ...]
) -> dict[str, Floats]:
    """Column -> (row,) variance by the covariance of the model; NaN where the model has none."""
    rows = len(by.joints_rad)
    if model.covariance is None:
        return {c: np.full(rows, np.nan) for c in columns}
    own = _by_name(found)
    slopes: list[Columns] = []
    for name in model.covariance.names:
        if name in own:
            port, basis = own[name]
            slopes.append(_felt(at, predictor, by, port, basis))
        else:
            start = predictor.values.get(name, 0.0)
            moved = [{**predictor.values, name: start + s * STEP} for s in (1.0, -1.0)]
            up, down = (at(replace(predictor, values=values), by) for values in moved)
            slopes.append({c: (up[c] - down[c]) / (2.0 * STEP) for c in columns})
    C = np.array(model.covariance.rows, dtype=np.float64)
    out: dict[str, Floats] = {}
    for c in columns:
        J = np.nan_to_num(np.stack([slope[c] for slope in slopes], axis=1)) if slopes else np.zeros((rows, 0))
        out[c] = np.einsum("ni,ij,nj->n", J, C, J) if slopes else np.zeros(rows)
    return out


def _by_name(found: Sequence[Acting]) -> dict[str, tuple[Port, Floats]]:
    """Name in the covariance -> port, and (row, width) that one unit of the value adds there."""
    out: dict[str, tuple[Port, Floats]] = {}
    for one in found:
        smooth = [spec.name for spec in one.carried.accepted.term.inner if not spec.discrete]
        effect = one.carried.record
        names = [*effect.coefficients, *(f"{effect.name}.{name}" for name in smooth)]
        for j, name in enumerate(names):
            out[name] = (one.port, one.by_value[..., j])
    return out


def _felt(at: At, predictor: Predictor, by: Perturbation, port: Port, amount: Floats) -> Columns:
    """Column -> (row,) change of the reading by what is added at a port (row, width), to first order."""
    largest = float(np.max(np.abs(amount), initial=0.0))
    if largest == 0.0:
        return {c: np.zeros(len(amount)) for c in at(predictor, by)}
    scale = STEP / largest
    up, down = (at(predictor, by.plus(port, s * scale * amount)) for s in (1.0, -1.0))
    return {c: (up[c] - down[c]) / (2.0 * scale) for c in up}


def _of_missing(
    carried: Sequence[Carried], found: Sequence[Acting], predictor: Predictor, recorded: Samples, filled: Completed
) -> list[tuple[Port, Floats]]:
    """What each effect would add if a condition that a row lacks were one standard deviation off its middle."""
    out: list[tuple[Port, Floats]] = []
    for name, rows in filled.missing.items():
        off = np.where(rows, float(np.nanstd(recorded.column(name))), 0.0)
        columns = {**filled.samples.columns, name: filled.samples.column(name) + off}
        other = acting(carried, predictor, recorded, joined(recorded, Samples(columns, recorded.n_joints)))
        out += [(a.port, b.amount - a.amount) for a, b in zip(found, other, strict=True)]
    return out


def _of_range(found: Sequence[Acting]) -> list[tuple[Port, Floats]]:
    """Beyond its recorded range an unknown cause may add anything that it has added within."""
    out: list[tuple[Port, Floats]] = []
    for one in found:
        if one.outside.any():
            w, V = np.linalg.eigh(one.spread)
            ways = (V * np.sqrt(np.maximum(w, 0.0))).T
            out += [(one.port, one.outside[:, None] * way) for way in ways if np.any(way != 0.0)]
    return out


def _outside(
    carried: Sequence[Carried], predictor: Predictor, both: Samples, first: int, filled: Completed
) -> tuple[str, ...]:
    """Names of drivers that are beyond their recorded range, one text a row."""
    drivers = drivers_under(predictor, both, Perturbation.none(len(both), both.n_joints))
    known: dict[str, tuple[float, float]] = {}
    for c in carried:
        known |= dict(c.record.range)
    beyond: Mapping[str, Bools] = {
        name: _beyond(values[first:], *known[name])
        for name, values in ((name, range_of(drivers, name)) for name in known)
        if values is not None
    }
    rows = range(len(filled.samples))
    return tuple(",".join(name for name, where in beyond.items() if where[row]) for row in rows)


def _beyond(values: Floats, low: float, high: float) -> Bools:
    slack = BEYOND * max(high - low, 1e-12)
    return np.asarray((values < low - slack) | (values > high + slack), dtype=np.bool_)


def _lacks(column: str, rows: Bools, carried: Sequence[Carried]) -> str:
    names = [c.record.name for c in carried if column in needed_columns(c.drivers, (column,))]
    return (
        f"{column} is missing in {int(rows.sum())} of {len(rows)} rows: taken as the mean of the session, sigma "
        f"widened ({', '.join(names)})"
    )
