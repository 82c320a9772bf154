"""Conditions as columns of samples.csv: those an effect needs of a row, and those that it was found under.

Many effects are stated about their session (the mean temperature, the largest torque, knots over a range), so a model
keeps the conditions of the samples it was found in, and new rows stand behind them when an effect is evaluated.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import SEAT
from calibrate.effects.conditions import moves_of, temperatures_of
from calibrate.effects.drivers import Drivers

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

USED_AS = ("placement", "first_psd", SEAT)  # how the instrument stood: without it a row has no reading to predict
BY_JOINT = {
    "approach": "approach{}",
    "last_move": "last_move{}_rad",
    "qd": "qd{}_rad_s",
    "cmd_minus_q": "cmd{}_rad",
}
OF_POSE = ("q", "spot", "incidence", "first_psd", "reading")  # what joints and the instrument's place say
BY_WEIGHT = ("gravity_torque", "overturning_moment", "payload")
PAYLOAD = ("payload_kg", "payload_com_x_m", "payload_com_y_m", "payload_com_z_m")


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
    """Column -> (sample,) of all that a session was taken under, as its effects were fitted to it."""
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
    """`needs` filled in: by the order in time and by smoothing among the session's own rows, if they are of it; else
    with the middle of what was recorded, where `missing` says so.
    """
    columns, missing = dict(asked.columns), dict[str, Bools]()
    if same_session:
        columns |= _among(asked, recorded)
    else:
        columns |= {f"temp_{place}_degC": values for place, values in temperatures_of(asked).items()}
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
    """Columns of the asked rows as rows of the recorded session: temperatures smoothed with its own, moves from
    the row before.
    """
    both, first = joined(recorded, asked), len(recorded)
    temperatures = {f"temp_{place}_degC": values[first:] for place, values in temperatures_of(both).items()}
    n = asked.n_joints
    plain = Samples({c: v for c, v in both.columns.items() if not c.startswith("last_move")}, n)
    moves, direction = moves_of(plain)
    derived = _joints(BY_JOINT["last_move"], moves[first:]) | _joints(BY_JOINT["approach"], direction[first:])
    return temperatures | {c: v for c, v in derived.items() if c not in asked}


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
