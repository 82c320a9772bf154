"""Effects of a model at samples: which of them act there, what they add to the chain, and what is not known of that."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import required
from calibrate.effects.ports import Perturbation, Port
from calibrate.errors import DataError
from calibrate.model_file import ModelFile
from calibrate.physics.acting import Acting, Carried, acting, drivers_under, listed, range_of
from calibrate.physics.conditions import Completed, against, completed, joined, needed_columns
from calibrate.physics.records import Effect
from calibrate.predict import Predictor

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

FEWEST = 2  # rows of a session, to have a spread
BEYOND = 1e-9  # of the recorded range: rounding


@dataclass(frozen=True, eq=False)
class Applied:
    """`doubts` are one standard deviation at a port that is no coefficient's; `outside` (row,) drivers beyond their
    recorded range, joined by commas; `notes` sentences for a person.
    """

    by: Perturbation
    found: tuple[Acting, ...]
    doubts: tuple[tuple[Port, Floats], ...]
    outside: tuple[str, ...]
    notes: tuple[str, ...]


def effects_at(model: ModelFile, predictor: Predictor, samples: Samples, same_session: bool) -> Applied:
    """`same_session`: the rows are of the recording that the effects were found in, whose clock they share. Elsewhere
    what slips and bumps have left behind at its end is applied.

    DataError for rows at which an effect of the model cannot be evaluated.
    """
    used, notes = _used(model.effects, same_session)
    nothing = Perturbation.none(len(samples), samples.n_joints)
    if model.session is None or not used:
        return Applied(nothing, (), (), ("",) * len(samples), notes)
    recorded = recorded_samples(model, samples.n_joints)
    carried = listed(used, drivers_under(predictor, recorded, Perturbation.none(len(recorded), samples.n_joints)))
    needs = needed_columns((d for c in carried for d in c.drivers), recorded.names)
    filled = completed(samples, recorded, needs, same_session)
    if not same_session:
        filled = _at_the_end(filled, model.session.last_t_s)
    both = joined(recorded, filled.samples)
    found = acting(carried, predictor, recorded, both)
    by = nothing
    for one in found:
        by = by.plus(one.port, one.amount)
    doubts = list(_of_range(found))
    for name, rows in filled.missing.items():
        felt = _of_missing(name, rows, carried, found, predictor, recorded, filled)
        doubts += [(one.port, off) for one, off in felt]
        notes = (*notes, *_lacks(name, rows, [one.carried.record.name for one, _ in felt]))
    outside = _outside(carried, predictor, both, len(recorded), filled)
    return Applied(by, found, tuple(doubts), outside, notes)


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


def _used(effects: Sequence[Effect], same_session: bool) -> tuple[list[Effect], tuple[str, ...]]:
    """Those that act, and a sentence for each that does not. An aftermath acts with the values of what left it."""
    by_name = {effect.name: effect for effect in effects}
    if same_session:
        return [e for e in effects if not e.after], ()
    left = {e.after for e in effects}
    used = [by_name[e.after] if e.after else e for e in effects if e.holds == "always"]
    return used, tuple(
        f"left out, true of its own session only: {e.name}"
        + ("; what it left behind at the end is applied" if e.name in left else "")
        for e in effects
        if e.holds != "always"
    )


def _at_the_end(filled: Completed, last_t_s: float) -> Completed:
    """What follows the clock is left out elsewhere, but for what stays as it was at the end of the session."""
    columns = {**filled.samples.columns, "t_s": np.full(len(filled.samples), last_t_s)}
    return Completed(Samples(columns, filled.samples.n_joints), filled.missing)


def _of_missing(
    name: str,
    rows: Bools,
    carried: Sequence[Carried],
    found: Sequence[Acting],
    predictor: Predictor,
    recorded: Samples,
    filled: Completed,
) -> list[tuple[Acting, Floats]]:
    """Effects that a condition which rows lack acts on, each with what it would add if that were one standard deviation
    off its middle. A column can be read together with one that an effect needs and do nothing itself.
    """
    off = np.where(rows, float(np.nanstd(recorded.column(name) - against(name, recorded))), 0.0)
    columns = {**filled.samples.columns, name: filled.samples.column(name) + off}
    other = acting(carried, predictor, recorded, joined(recorded, Samples(columns, recorded.n_joints)))
    shifts = [(a, b.amount - a.amount) for a, b in zip(found, other, strict=True)]
    return [(a, shift) for a, shift in shifts if np.any(shift)]


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


def _lacks(column: str, rows: Bools, effects: Sequence[str]) -> tuple[str, ...]:
    """Nothing where no effect is changed by it."""
    if not effects:
        return ()
    return (
        f"{column} is missing in {int(rows.sum())} of {len(rows)} rows: taken as the mean of the session, sigma "
        f"widened ({', '.join(effects)})",
    )
