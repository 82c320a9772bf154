"""Effects of a model at samples: which of them act there, what they add to the chain, and what is not known of that.

Conditions are columns of samples.csv: those an effect needs of a row, and those that it was found under. Many effects
are stated about their session (the mean temperature, the largest torque, knots over a range), so a model keeps the
conditions of its own samples, and new rows are appended to them when an effect is evaluated.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import PLANE, SEAT, required
from calibrate.errors import DataError
from calibrate.model.effect_records import EffectRecord
from calibrate.model.effects.conditions import MOVED_RAD, moves_of, uncoupled_samples
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.loads import UNSTATED_CENTRE_M
from calibrate.model.effects.payload_compliance import UNKNOWN_CENTRE
from calibrate.model.effects.ports import Perturbation, Port
from calibrate.model.model_file import ModelFile
from calibrate.model.predict import Predictor
from calibrate.model.with_effects.acting import (
    Acting,
    Carried,
    acting,
    drivers_under,
    listed,
    range_of,
)

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

USED_AS = ("placement", "first_psd", SEAT, PLANE, "target")  # instrument or tool: else a row has another reading
BY_JOINT = {
    "approach": "approach{}",
    "last_move": "last_move{}_rad",
    "qd": "qd{}_rad_s",
    "cmd_minus_q": "cmd{}_rad",
}
OF_POSE = ("q", "spot", "incidence", "first_psd", "reading")  # what follows from joints and the instrument's place
BY_WEIGHT = ("gravity_torque", "overturning_moment", "payload")
PAYLOAD = ("payload_kg", "payload_com_x_m", "payload_com_y_m", "payload_com_z_m")
CENTRE = PAYLOAD[1:]


@dataclass(frozen=True, eq=False)
class Completed:
    """Rows that were asked for, with every column that the effects need; `missing` (row,) by column that was filled."""

    samples: Samples
    missing: Mapping[str, Bools]


def needed_columns(depends_on: Iterable[str], recorded: Iterable[str]) -> tuple[str, ...]:
    """Columns, among those recorded, that these drivers are read from; joints and time aside."""
    held = tuple(recorded)
    return tuple(c for c in dict.fromkeys(c for name in depends_on for c in _columns_of(name)) if c in held)


def recorded_conditions(drivers: Drivers, samples: Samples) -> dict[str, Floats]:
    """Column -> (sample,) of all that a session was taken under, as its effects were fitted to it.

    What is of joints is counted from the link in front, also where the controller counts otherwise.
    """
    out: dict[str, Floats] = {"t_s": drivers.t_s} | _joints("q{}_rad", drivers.q_rad)
    out |= {name: samples.column(name) for name in USED_AS if name in samples}
    for stem, values in (
        ("approach", drivers.approach),
        ("last_move", drivers.last_move_rad),
        ("qd", drivers.qd_rad_s),
        ("cmd_minus_q", None if drivers.cmd_minus_q_rad is None else drivers.q_rad + drivers.cmd_minus_q_rad),
    ):
        out |= {} if values is None else _joints(BY_JOINT[stem], values)
    out |= {f"temp_{place}_degC": values for place, values in drivers.temperatures_degC.items()}
    out |= {} if drivers.payload_kg is None else {PAYLOAD[0]: drivers.payload_kg}
    com, total = drivers.payload_com_m, drivers.psd_sum_v
    out |= {} if com is None else dict(zip(PAYLOAD[1:], com.T, strict=True))
    out |= {} if total is None else {f"psd{k + 1}_sum_v": total[:, k] for k in range(2)}
    out |= drivers.extra
    return out


def kept_conditions(every: Mapping[str, Floats], needs: Iterable[str]) -> dict[str, Floats]:
    """Joints, time, how the instrument stood, and what the effects found in the session need."""
    names = {"t_s", *USED_AS, *needs}
    return {c: v for c, v in every.items() if c in names or (c[0] == "q" and c[1:].removesuffix("_rad").isdigit())}


def completed(asked: Samples, recorded: Samples, needs: Iterable[str], same_session: bool) -> Completed:
    """`needs` filled in: by what the session recorded about that time, if they are rows of it; else with the middle of
    what was recorded, where `missing` has the row. How many rows are asked for changes nothing that they state.
    """
    columns, missing = dict(asked.columns), dict[str, Bools]()
    if same_session:
        columns |= _among(asked, recorded)
    for name in needs:
        values = np.asarray(columns.get(name, np.full(len(asked), np.nan)), dtype=np.float64)
        given = np.isfinite(asked.column(name)) if name in asked else np.isfinite(values)
        middle = against(name, asked) + float(np.nanmean(recorded.column(name) - against(name, recorded)))
        columns[name] = np.where(np.isfinite(values), values, middle)
        if not given.all():
            missing[name] = ~given & ~(np.isfinite(values) & same_session)
    return Completed(Samples(columns, asked.n_joints), {name: rows for name, rows in missing.items() if rows.any()})


def against(name: str, samples: Samples) -> Floats:
    """(row,) what a condition is stated against: a commanded angle against the reading, all others against nothing."""
    commanded = name.startswith("cmd") and name.endswith("_rad")
    return samples.column("q" + name.removeprefix("cmd")) if commanded else np.zeros(len(samples))


def joined(recorded: Samples, asked: Samples) -> Samples:
    """The recorded rows, then those asked for, with the columns of the recorded ones."""
    n = len(asked)

    def behind(name: str) -> Floats:
        return asked.column(name) if name in asked else np.full(n, np.nan)

    return Samples(
        {name: np.concatenate([values, behind(name)]) for name, values in recorded.columns.items()}, recorded.n_joints
    )


def _among(asked: Samples, recorded: Samples) -> dict[str, Floats]:
    """Columns of the asked rows of the recorded session: its smoothed temperatures at their times, before and
    after it what they state; moves from the recorded row before, and of a row that was recorded its own.
    """
    t, own, q_rad = asked.column("t_s"), recorded.column("t_s"), asked.joints()
    order, within = np.argsort(own, kind="stable"), (t >= own.min()) & (t <= own.max())
    columns: dict[str, Floats] = {}
    for c in (c for c in recorded.names if c.startswith("temp_")):
        of_session = np.interp(t, own[order], recorded.column(c)[order])
        stated = asked.column(c) if c in asked else of_session
        columns[c] = np.where(within | ~np.isfinite(stated), of_session, stated)
    before = np.searchsorted(own[order], t, side="left")
    earlier, same = order[np.maximum(before - 1, 0)], order[np.minimum(before, len(order) - 1)]
    moves, direction = moves_of(recorded)
    for joint, name in enumerate(_joints(BY_JOINT["approach"], direction)):
        direction[:, joint] = recorded.column(name) if name in recorded else direction[:, joint]
    later = (before > 0)[:, None]
    moved = np.where(later, q_rad - recorded.joints()[earlier], 0.0)
    twin = ((own[same] == t) & (np.abs(q_rad - recorded.joints()[same]).max(axis=1) <= MOVED_RAD))[:, None]
    turned = np.where(np.abs(moved) > MOVED_RAD, np.sign(moved), np.where(later, direction[earlier], 0.0))
    derived = _joints(BY_JOINT["last_move"], np.where(twin, moves[same], moved))
    derived |= _joints(BY_JOINT["approach"], np.where(twin, direction[same], turned))
    return columns | {c: v for c, v in derived.items() if c not in asked}


def _columns_of(driver: str) -> tuple[str, ...]:
    stem = driver.rstrip("0123456789")
    number = driver[len(stem) :]
    if stem in BY_JOINT:
        return (BY_JOINT[stem].format(number),)
    if stem in BY_WEIGHT:
        return PAYLOAD
    if driver.startswith("psd") and driver.endswith("_sum"):
        return ("psd1_sum_v", "psd2_sum_v")
    if driver == "t" or stem in OF_POSE:
        return ()
    return (f"{driver}_degC",) if driver.startswith("temp_") else (driver,)


def _joints(form: str, values: Floats) -> dict[str, Floats]:
    return {form.format(i + 1): values[:, i] for i in range(values.shape[1])}


FEWEST = 2  # rows of a session, to have a spread
BEYOND = 1e-9  # of the recorded range: rounding


@dataclass(frozen=True, eq=False)
class Applied:
    """`doubts` are one standard deviation at a port that is no coefficient's; `outside` (row,) drivers beyond their
    recorded range, joined by commas; `notes` sentences for a person.
    """

    by: Perturbation
    found: tuple[Acting, ...]
    uncertain: tuple[tuple[Port, Floats], ...]
    outside: tuple[str, ...]
    notes: tuple[str, ...]


def effects_at(
    model: ModelFile, predictor: Predictor, samples: Samples, same_session: bool, *, with_open: bool = True
) -> Applied:
    """`same_session`: the rows are of the recording that the effects were found in, whose clock they share. Elsewhere
    what slips and bumps have left behind at its end is applied. Without `with_open` only what the effects add is found
    and not what is unknown of it.

    DataError for rows at which an effect of the model cannot be evaluated.
    """
    acting_here, notes = acting_effects(model.effects, same_session, "is applied")
    used = [effect for effect, _ in acting_here]
    nothing = Perturbation.none(len(samples), samples.n_joints)
    if model.session is None or not used:
        return Applied(nothing, (), (), ("",) * len(samples), notes)
    samples = uncoupled_samples(predictor.rig.arm, samples)
    recorded, of_load = _with_payload(recorded_samples(model, samples.n_joints), samples, used)
    notes = (*notes, *of_load)
    carried = listed(used, drivers_under(predictor, recorded, Perturbation.none(len(recorded), samples.n_joints)))
    needs = needed_columns((d for c in carried for d in c.drivers), recorded.names)
    filled = completed(samples, recorded, needs, same_session)
    if not same_session:
        filled = _at_the_end(filled, model.session.last_t_s)
    both = joined(recorded, filled.samples)
    found = acting(carried, predictor, recorded, both)
    by = Perturbation.of_all(len(samples), samples.n_joints, (one.added for one in found))
    if not with_open:
        return Applied(by, found, (), ("",) * len(samples), notes)
    uncertain = [*_of_range(found), *((one.port, one.undated) for one in found if np.any(one.undated))]
    notes = (*notes, *(_between(one) for one in found if np.any(one.undated)))
    for name, rows in filled.missing.items():
        if name in CENTRE and not same_session:
            continue  # _of_centres, which also knows rows of a session that did not record it
        felt = _of_missing(name, rows, carried, found, predictor, recorded, filled)
        uncertain += [(one.port, off) for one, off in felt]
        notes = (*notes, *_lacks(name, rows, [one.carried.record.name for one, _ in felt]))
    if not same_session:  # the fit has seen what the loads of its own rows do
        for what, name, felt in _of_centres(samples, filled, carried, predictor, recorded):
            uncertain += felt
            notes = (*notes, f"{what}, sigma widened by {UNSTATED_CENTRE_M:g} m along each axis ({name})")
    outside = _outside(carried, found, predictor, both, len(recorded))
    return Applied(by, found, tuple(uncertain), outside, notes)


def recorded_samples(model: ModelFile, n_joints: int) -> Samples:
    """The conditions of the model's session as a table, joints counted from the link in front.

    DataError where a column that every row has is missing.
    """
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


def acting_effects(
    effects: Sequence[EffectRecord], same_session: bool, left_does: str
) -> tuple[list[tuple[EffectRecord, bool]], tuple[str, ...]]:
    """Those that act, and whether they have happened before the first row; a sentence for each that does not act. What
    one left behind acts with the values of that one; `left_does` is the end of its sentence.
    """
    by_name = {effect.name: effect for effect in effects}
    if same_session:
        return [(e, False) for e in effects if not e.after], ()
    left = {e.after for e in effects}
    here = [(by_name[e.after], True) if e.after else (e, False) for e in effects if e.holds == "always"]
    return here, tuple(
        f"left out, true of its own session only: {e.name}"
        + (f"; what it left behind at the end {left_does}" if e.name in left else "")
        for e in effects
        if e.holds != "always"
    )


def by_weight(depends_on: Iterable[str]) -> bool:
    """Whether one of these drivers is a weight."""
    return any(name.rstrip("0123456789") in BY_WEIGHT for name in depends_on)


def conditions_of_effects(model: ModelFile) -> frozenset[str]:
    """Columns that a prediction with this model can use; the payload, wherever something yields to weight."""
    weighs = any(by_weight(effect.depends_on.split(",")) for effect in model.effects)
    return frozenset(model.needs) | (frozenset(PAYLOAD) if weighs else frozenset())


def _with_payload(
    recorded: Samples, asked: Samples, effects: Sequence[EffectRecord]
) -> tuple[Samples, tuple[str, ...]]:
    """The session's rows with the columns of a payload that the rows asked for state and the session did not record.

    Without a payload in the session they are nought there, and nothing else changes; sentences on what was assumed.
    """
    load_kg, columns = _payload_kg(asked), dict(recorded.columns)
    if not load_kg.any() or not any(by_weight(effect.depends_on.split(",")) for effect in effects):
        return recorded, ()
    notes: tuple[str, ...] = ()
    if PAYLOAD[0] not in recorded:
        columns[PAYLOAD[0]] = np.zeros(len(recorded))
        notes = ("payload_kg was not recorded in the session of the model: taken as 0 kg there; record it, 0 too",)
    lacking = [name for name in CENTRE if name not in recorded]
    if lacking and any(name in asked for name in CENTRE):
        if columns[PAYLOAD[0]].any():
            notes = (*notes, f"{', '.join(CENTRE)} are not used: the session of the model carried a payload and did "
                     "not record where; record them, and diagnose again")  # fmt: skip
        else:
            columns |= {name: np.zeros(len(recorded)) for name in CENTRE}
    return Samples(columns, recorded.n_joints), notes


def _payload_kg(samples: Samples) -> Floats:
    """(row,), 0 where none is stated."""
    return np.nan_to_num(samples.column(PAYLOAD[0])) if PAYLOAD[0] in samples else np.zeros(len(samples))


def _of_centres(
    asked: Samples, filled: Completed, carried: Sequence[Carried], predictor: Predictor, recorded: Samples
) -> Iterator[tuple[str, str, list[tuple[Port, Floats]]]]:
    """Loads at the flange whose centre of mass nobody states: a sentence, the effects, and one sigma at their ports.

    An effect that found the payload's first moment itself has it among its coefficients.
    """
    weighed = [c for c in carried if by_weight(c.drivers) and c.record.variant != UNKNOWN_CENTRE]
    if not weighed:
        return
    zero = {name: np.zeros(len(recorded)) for name in CENTRE if name not in recorded}
    old = Samples({**recorded.columns, **zero}, recorded.n_joints)
    at = {name: filled.samples.columns.get(name, np.zeros(len(asked))) for name in CENTRE}
    if zero:
        at = {name: np.zeros(len(asked)) for name in CENTRE}  # the session did not record it: not used
    if PAYLOAD[0] in filled.missing:  # of an unknown load no less is unknown than of the heaviest that was recorded
        heaviest = np.nanmax(recorded.column(PAYLOAD[0]))
        at[PAYLOAD[0]] = np.where(filled.missing[PAYLOAD[0]], heaviest, filled.samples.column(PAYLOAD[0]))

    def added(by: Predictor, centre: Mapping[str, Floats]) -> list[Floats]:
        new = Samples({**filled.samples.columns, **centre}, recorded.n_joints)
        return [one.amount for one in acting(weighed, by, old, joined(old, new))]

    plain = added(predictor, at)

    def felt(others: Iterable[list[Floats]]) -> tuple[str, list[tuple[Port, Floats]]]:
        each = [(c, b - a) for other in others for c, a, b in zip(weighed, plain, other, strict=True)]
        some = [(c, shift) for c, shift in each if np.any(shift)]
        names = ", ".join(dict.fromkeys(c.record.name for c, _ in some))
        return names, [(c.accepted.term.port, shift) for c, shift in some]

    stated = np.all(
        [np.isfinite(asked.column(c)) if c in asked else np.zeros(len(asked), bool) for c in CENTRE], axis=0
    )
    carries = _payload_kg(filled.samples) != 0.0
    rows = carries & (~stated | bool(zero))
    if rows.any():
        off = np.where(rows, UNSTATED_CENTRE_M, 0.0)
        names, uncertain = felt([added(predictor, {**at, name: at[name] + off}) for name in CENTRE])
        where = "at the flange" if zero or not np.any([at[name] for name in CENTRE]) else "where it was in the session"
        if uncertain:
            yield (
                f"{', '.join(CENTRE)} are missing in {int(rows.sum())} of {int(carries.sum())} rows with a payload "
                f"(state them, and record them in the session): centre of mass taken {where}", names, uncertain,
            )  # fmt: skip
    tool = predictor.rig.tool
    if tool.mass_kg and tool.com_m is None:
        turned = (tuple((UNSTATED_CENTRE_M * axis).tolist()) for axis in np.eye(3))
        rigs = (structs.replace(predictor.rig, tool=structs.replace(tool, com_m=com)) for com in turned)
        names, uncertain = felt([added(replace(predictor, rig=rig), at) for rig in rigs])
        if uncertain:
            says = f"rig {predictor.rig.name}: [tool] com_m is not stated (state it): centre of mass of its"
            yield f"{says} {tool.mass_kg:g} kg taken at the flange", names, uncertain


def _at_the_end(filled: Completed, last_t_s: float) -> Completed:
    """What follows the clock is left out elsewhere, but for what stays as it was at the end of the session."""
    columns = {**filled.samples.columns, "t_s": np.full(len(filled.samples), last_t_s)}
    return replace(filled, samples=Samples(columns, filled.samples.n_joints))


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
    carried: Sequence[Carried], found: Sequence[Acting], predictor: Predictor, both: Samples, first: int
) -> tuple[str, ...]:
    """Names of drivers that are beyond their recorded range, or in the gap of it that hides a step; one text a row."""
    drivers = drivers_under(predictor, both, Perturbation.none(len(both), both.n_joints))
    known: dict[str, tuple[float, float]] = {}
    for c in carried:
        known |= dict(c.record.range)
    beyond: dict[str, Bools] = {
        name: _beyond(values[first:], *known[name])
        for name, values in ((name, range_of(drivers, name)) for name in known)
        if values is not None
    }
    for one in found:
        for name in one.carried.drivers if np.any(one.undated) else ():
            beyond[name] = np.any(one.undated, axis=1) | beyond.get(name, False)
    rows = range(len(both) - first)
    return tuple(",".join(name for name, where in beyond.items() if where[row]) for row in rows)


def _beyond(values: Floats, low: float, high: float) -> Bools:
    slack = BEYOND * max(high - low, 1e-12)
    return np.asarray((values < low - slack) | (values > high + slack), dtype=np.bool_)


def _between(one: Acting) -> str:
    rows = int(np.any(one.undated, axis=1).sum())
    return (
        f"{rows} of {len(one.undated)} rows lie between the recorded rows where {one.carried.record.name} stepped: "
        "whether before or after it is not recorded; sigma widened"
    )


def _lacks(column: str, rows: Bools, effects: Sequence[str]) -> tuple[str, ...]:
    """Nothing where no effect is changed by it."""
    if not effects:
        return ()
    return (
        f"{column} is missing in {int(rows.sum())} of {len(rows)} rows: taken as the mean of the session, sigma "
        f"widened ({', '.join(effects)})",
    )
