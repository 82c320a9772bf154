"""A foreign table in SI: what it is understood to mean, which units are open, and the samples that come of it.

A unit is never assumed. Where none stands, or the one that stands makes values that no arm can have, there is a
`Question`; `answered` settles it. What a person states is taken, up to the bounds of all files.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, time
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.bounds import SPAN_S
from acquisition.recording.foreign.column_meanings import (
    POSE_MATRIX,
    TEXT,
    TIME,
    UNUSED,
    Group,
    bare_meaning,
    unit_in,
)
from acquisition.recording.foreign.heading_search import understood
from acquisition.recording.foreign.heading_units import AMBIGUOUS, Unit, symbols, unit_of
from acquisition.recording.foreign.rotations import CONVENTIONS, bad_matrix, bad_quaternion, of_matrices
from acquisition.recording.foreign.sheet import Raw, Sheet
from acquisition.recording.foreign.sheet_times import check_times
from acquisition.recording.rig import Rig, parse_rig
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import TARGET, Cell, Floats, Samples, cells_of, per_joint

EPOCH_S = SPAN_S  # a time beyond counts from 1970 or the like
FEWEST = 3  # rows whose spread shows something of their unit
Exact = int | float | Decimal


@dataclass(frozen=True)
class Plausible:
    """What a quantity can be in SI: largest value, and spread of the widest of its columns over a session."""

    largest: float
    least_spread: float = 0.0
    most_spread: float = math.inf


# The longest arm measures 17.6 m stretched out; a laser tracker measures 160 m; joints turn once or twice.
_PLAUSIBLE: Mapping[str, Plausible] = {
    "q": Plausible(7.0, 0.2),
    "cmd": Plausible(7.0, 0.2),
    "qd": Plausible(100.0),
    "position": Plausible(200.0, 0.02, 40.0),
    "wire": Plausible(200.0, 0.02, 40.0),
    "abc": Plausible(7.0, 0.1),
    "wpr": Plausible(7.0, 0.1),
    "rotvec": Plausible(7.0, 0.1),
    "payload": Plausible(3000.0),
    "payload_com_x": Plausible(5.0),
    "payload_com_y": Plausible(5.0),
    "payload_com_z": Plausible(5.0),
}
_BY_SUFFIX: Mapping[str, Plausible] = {"degC": Plausible(300.0), "v": Plausible(1000.0)}


@dataclass(frozen=True)
class Question:
    """A unit that is open: why, what it may be, and what the values suggest ("" for nothing)."""

    group: Group
    headings: tuple[str, ...]
    place: str
    why: str
    choices: tuple[str, ...]
    proposal: str

    @property
    def asks(self) -> str:
        """The question for a person."""
        ends = self.headings[0] if len(self.headings) == 1 else f"{self.headings[0]} … {self.headings[-1]}"
        return f"{ends} ({self.group.meaning}): {self.why}. Unit?"

    @property
    def refusal(self) -> str:
        """The error where nobody can be asked: place, columns, reason, remedy."""
        names = self.headings
        quoted = " ".join(f"'{name}'" if any(c in name for c in " ,=[].'") else name for name in names)
        unit = self.proposal or "|".join(self.choices)
        column = f"column '{shown(names[0], 40)}'" if len(names) == 1 else f"columns '{shown(names[0], 30)}' …"
        return (
            f'{self.place}, {column}: {self.why}; state the unit: --columns "{shown(quoted, 80)} [{unit}] = '
            f'{self.group.meaning}"'
        )


@dataclass(frozen=True, eq=False)
class Understanding:
    """A table and what its columns mean; `numbers`: the cells of every column that is used, as they stand."""

    sheet: Sheet
    rig_text: str
    rig: Rig
    groups: tuple[Group, ...]
    numbers: Mapping[int, Floats]

    def answered(self, question: Question, unit: str) -> "Understanding":
        """With a unit that a person has stated."""
        groups = (replace(g, unit=unit, stated=True) if g == question.group else g for g in self.groups)
        return replace(self, groups=tuple(groups))

    def headings(self, group: Group) -> tuple[str, ...]:
        return tuple(self.sheet.headings[column] for column in group.columns)

    def unit_in(self, column: int) -> str:
        """The unit that stands with a column."""
        return unit_in(self.sheet, column)

    def unused(self) -> tuple[str, ...]:
        """Headings of the columns that nothing becomes of."""
        used = {column for group in self.groups if group.meaning != UNUSED for column in group.columns}
        return tuple(h for column, h in enumerate(self.sheet.headings) if column not in used and h)


def understand(
    sheet: Sheet, rig_text: str, rig_name: str, columns: str = "", *, whole_rows: bool = True
) -> Understanding:
    """What a table means for this rig. `whole_rows`: what belongs together is there or missing together in a row.

    SamplesError, RigFileError naming the place, the value and the remedy.
    """
    rig = parse_rig(rig_text, rig_name)
    groups = understood(sheet, rig.n_encoders, columns, with_arm=rig.n_joints > 0)
    numbers: dict[int, Floats] = {}
    for group in groups:
        if group.meaning == UNUSED or group.meaning == TIME or group.meaning in TEXT:
            continue
        for column in group.columns:
            read = sheet.numbers_of_names if group.meaning == TARGET else sheet.numbers
            numbers[column] = np.array(read(column), dtype=np.float64)
        if whole_rows:
            _check_whole_rows(sheet, group, numbers)
    return Understanding(sheet, rig_text, rig, groups, numbers)


def questions(table: Understanding, *, settled: bool = True) -> Iterator[Question]:
    """The units that are open. `settled`: rows are poses of a session, whose spread is that of an arm's work."""
    for group in table.groups:
        if not group.suffix or (group.meaning == TIME and is_dated(table.sheet, group.columns[0])):
            continue
        unit = unit_of(group.unit)
        ambiguous = group.suffix == "rad" and unit is not None and unit.suffix == AMBIGUOUS
        choices = symbols(AMBIGUOUS if ambiguous else group.suffix)
        if group.stated and (unit is None or unit.suffix != group.suffix):
            raise SamplesError(
                f"--columns: '{shown(group.unit, 20)}' is no unit of {group.meaning}; use {', '.join(choices)}"
            )
        if ambiguous:
            why = f"'{shown(group.unit, 20)}' is the degree in some programs and the gon in others; write deg or gon"
        elif group.unit and unit is None:
            why = f"the unit '{shown(group.unit, 20)}' is not known"
        elif unit is not None and unit.suffix != group.suffix:
            why = f"'{shown(group.unit, 20)}' is no unit of {group.meaning}"
        elif unit is None:
            why = f"no unit stands there, and the values are {_span(table, group)}"
        elif group.stated or (fault := _fault(table, group, unit, settled=settled)) is None:
            continue
        else:
            why = fault
        fitting = [s for s in choices if (u := unit_of(s)) and _fault(table, group, u, settled=settled) is None]
        proposal = fitting[0] if len(fitting) == 1 else ""
        yield Question(group, table.headings(group), table.sheet.place(), why, choices, proposal)


def samples_of(table: Understanding) -> Samples:
    """The samples in SI. SamplesError naming file, sheet, row, column, value and remedy."""
    columns: dict[str, Sequence[Cell]] = {}
    sheet, n_joints = table.sheet, table.rig.n_joints
    for group in table.groups:
        if group.meaning == UNUSED:
            continue
        if group.meaning in TEXT:
            texts = [None if c is None else str(c).strip().lower() for c in sheet.cells(group.columns[0])]
            columns |= {group.targets(n_joints)[0]: texts}
            continue
        values = converted(table, group)
        columns |= {n: cells_of(n, v) for n, v in zip(group.targets(n_joints), values.T, strict=True)}
    if "t_s" not in columns:
        columns = {"t_s": [float(row) for row in range(len(sheet.rows))], **columns}
    missing = [name for name in per_joint("q", "_rad", n_joints) if name not in columns]
    if missing:
        raise SamplesError(
            f"{sheet.place()}: no columns are understood as the {n_joints} joint angles ({sheet.titles}); state which "
            f'they are: --columns "A1..A{n_joints} [deg] = q", or the row of the headings: --header-row'
        )
    if not any(group.measures or (group.kept and group.meaning != UNUSED) for group in table.groups):
        raise SamplesError(
            f"{sheet.place()}: no column is understood as a measurement ({sheet.titles}); state which it is: "
            '--columns "X Y Z [mm] = position"'
        )
    ordered = {name: columns[name] for name in ("t_s", *per_joint("q", "_rad", n_joints))} | columns
    return checked_samples(ordered, table.rig, sheet.place)


def converted(table: Understanding, group: Group) -> Floats:
    """(row, target) one group in SI; time counts from its first row where it counts from 1970 or the like."""
    sheet = table.sheet
    if group.meaning == TIME:
        times = times_of(sheet, group.columns[0])
        check_times(sheet, group.columns[0], times, unit_of(group.unit))
        return seconds_since(times, base_of(times, group), group)[:, None]
    raw = np.stack([table.numbers[column] for column in group.columns], axis=1)
    unit = unit_of(group.unit) if group.suffix else None
    bare = bare_meaning(group.meaning)
    if bare == POSE_MATRIX:
        return _poses(table, group, raw, unit)
    values = raw if unit is None else raw * unit.factor + unit.offset
    if bare not in CONVENTIONS:
        return values
    if bare.startswith("quaternion"):
        _refuse_row(table, group, bad_quaternion(raw), "its length is not 1", "order and columns of the quaternion")
    if bare == "matrix":
        _refuse_row(table, group, bad_matrix(raw), "it is no rotation", "order and columns of the matrix")
    return CONVENTIONS[bare][0](values)


def times_of(sheet: Sheet, column: int) -> list[Exact]:
    """The times of a column as they stand, dates as seconds since 1970. SamplesError for a cell that is none."""
    return [_time(sheet, row, column, cell) for row, cell in enumerate(sheet.cells(column))]


def seconds_since(times: Sequence[Exact], base: Exact, group: Group) -> Floats:
    """(row,) seconds; the difference is taken before anything is rounded: nanoseconds since 1970 are exact."""
    unit = unit_of(group.unit)
    factor = 1.0 if unit is None else unit.factor  # None: dates
    exact = any(isinstance(t, Decimal) for t in (*times, base))
    less = [_decimal(t) - _decimal(base) for t in times] if exact else [t - base for t in times]  # pyright: ignore[reportOperatorIssue]
    return np.array([float(t) for t in less], dtype=np.float64) * factor


def _check_whole_rows(sheet: Sheet, group: Group, numbers: Mapping[int, Floats]) -> None:
    """SamplesError for a row in which only some of the columns that belong together are filled, and for no joints."""
    raw = np.stack([numbers[column] for column in group.columns], axis=1)
    missing = np.isnan(raw)
    bad = missing.any(axis=1) & (np.full(len(raw), group.meaning == "q") | ~missing.all(axis=1))
    if bad.any():
        row = int(np.argmax(bad))
        column = group.columns[int(np.argmax(missing[row]))]
        others = "a joint angle is needed in every row" if group.meaning == "q" else "the others of the row are there"
        raise SamplesError(
            f"{sheet.place(row, column)}: the value is missing, and {others}; complete or remove the row"
        )


def _poses(table: Understanding, group: Group, raw: Floats, unit: Unit | None) -> Floats:
    """(row, 6) of 12 or 16 columns of a 4 x 4 matrix, row by row."""
    m = raw[:, :12].reshape(-1, 3, 4)
    if raw.shape[1] == 16:
        wrong = np.any(np.abs(raw[:, 12:] - [0.0, 0.0, 0.0, 1.0]) > 1e-9, axis=1)
        _refuse_row(table, group, wrong, "its last row is not 0 0 0 1", "order and columns of the matrix")
    turn = np.ascontiguousarray(m[:, :, :3]).reshape(-1, 9)
    _refuse_row(table, group, bad_matrix(turn), "it is no rotation", "order and columns of the matrix")
    factor = 1.0 if unit is None else unit.factor
    return np.concatenate([m[:, :, 3] * factor, of_matrices(turn)], axis=1)


def _refuse_row(table: Understanding, group: Group, bad: NDArray[np.bool_], why: str, what: str) -> None:
    if not bad.any():
        return
    row, first = int(np.argmax(bad)), group.columns[0]
    cells = ", ".join(f"{table.numbers[c][row]:g}" for c in group.columns[:4])
    more = ", …" if len(group.columns) > 4 else ""
    raise SamplesError(
        f"{table.sheet.place(row, first)}: {cells}{more} as {group.meaning}: {why}; check {what}, and state "
        "another meaning with --columns"
    )


def _fault(table: Understanding, group: Group, unit: Unit, *, settled: bool) -> str | None:
    """Why values cannot be in this unit; None where they can."""
    if unit.suffix != group.suffix or group.meaning == TIME:
        return None  # a time stands for order and drift: no value of it is impossible
    plausible = _plausible(table.rig, group)
    values = np.stack([table.numbers[c] for c in group.columns], axis=1)
    if group.meaning.endswith(POSE_MATRIX):
        values = values[:, 3::4][:, :3]
    values = values * unit.factor + unit.offset
    if np.isnan(values).all():
        return None  # without a reading no unit can be judged
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    spread = float(np.max(_spreads(values), initial=0.0))
    si = {"rad": "rad", "m": "m", "degC": "°C", "v": "V", "kg": "kg", "rad_s": "rad/s"}.get(group.suffix, group.suffix)
    if largest > plausible.largest:
        return f"in {unit.symbol} the values reach {largest:.4g} {si}, at most {plausible.largest:g} {si} are possible"
    if spread > plausible.most_spread:
        return (
            f"in {unit.symbol} the values span {spread:.4g} {si}, at most {plausible.most_spread:g} {si} are possible"
        )
    if settled and len(values) >= FEWEST and spread < plausible.least_spread:
        return f"in {unit.symbol} the values span {spread:.2g} {si} only"
    return None


def _plausible(rig: Rig, group: Group) -> Plausible:
    bare = bare_meaning(group.meaning)
    if bare in ("q", "cmd"):
        ends = [abs(end) for joint in rig.arm.joints for end in (joint.lower_rad, joint.upper_rad)]
        return Plausible(max(_PLAUSIBLE["q"].largest, *(end + 0.5 for end in ends)), _PLAUSIBLE["q"].least_spread)
    if bare == POSE_MATRIX:
        return _PLAUSIBLE["position"]
    if bare.startswith("psd") and group.suffix == "m":
        return Plausible(1.0 if rig.fixture is None else 2.0 * rig.fixture.half_size_m)
    return _PLAUSIBLE.get(bare) or _BY_SUFFIX.get(group.suffix) or Plausible(math.inf)


def _spreads(values: Floats) -> Floats:
    there = [column[np.isfinite(column)] for column in values.T]
    return np.array([float(np.ptp(column)) if column.size else 0.0 for column in there])


def _span(table: Understanding, group: Group) -> str:
    if group.meaning == TIME:
        times = times_of(table.sheet, group.columns[0])
        return f"{float(times[0]):.12g} … {float(times[-1]):.12g}"
    columns = group.columns[3::4][:3] if group.meaning.endswith(POSE_MATRIX) else group.columns
    values = np.concatenate([table.numbers[c] for c in columns])
    there = values[np.isfinite(values)]
    return f"{there.min():g} … {there.max():g}" if there.size else "missing"


def _time(sheet: Sheet, row: int, column: int, cell: Raw) -> Exact:
    if isinstance(cell, datetime):
        return Decimal(str(cell.timestamp())) if cell.tzinfo else _naive(cell)
    if isinstance(cell, time):
        return Decimal(cell.hour * 3600 + cell.minute * 60 + cell.second) + Decimal(cell.microsecond).scaleb(-6)
    if isinstance(cell, int | float) and not isinstance(cell, bool) and math.isfinite(cell):
        return cell
    if isinstance(cell, str):
        try:
            if (value := Decimal(cell.replace(",", "."))).is_finite():
                return value
        except ArithmeticError:
            pass
        try:
            return _time(sheet, row, column, datetime.fromisoformat(cell))
        except ValueError:
            pass
    given = "an empty cell" if cell is None else f"'{shown(str(cell), 40)}'"
    raise SamplesError(
        f"{sheet.place(row, column)}: {given} is no time; write a number, or date and time as 2026-01-31 12:00:00.000"
    )


def _naive(moment: datetime) -> Decimal:
    """Seconds by the wall clock: a session does not cross a change of the hour."""
    since = moment - datetime(1970, 1, 1)
    return Decimal(since.days * 86400 + since.seconds) + Decimal(since.microseconds).scaleb(-6)


def is_dated(sheet: Sheet, column: int) -> bool:
    """Whether the times are those of a calendar or a day, which need no unit."""
    cells = sheet.cells(column)
    return bool(cells) and all(isinstance(c, datetime | time) or (isinstance(c, str) and ":" in c) for c in cells)


def base_of(times: Sequence[Exact], group: Group) -> Exact:
    """Where time is counted from: 0, or the first row where it counts from 1970 or the like."""
    unit = unit_of(group.unit)
    factor = 1.0 if unit is None else unit.factor
    return times[0] if times and abs(float(times[0])) * factor > EPOCH_S else 0


def _decimal(value: Exact) -> Decimal:
    return value if isinstance(value, Decimal) else Decimal(value)
