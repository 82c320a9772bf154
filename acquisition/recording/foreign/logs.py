"""Logs of other programs as streams: one table a device, each row a moment; bags of ROS are tables, too, one a topic.

Joints become channels that the diagnosis of streams reads (`actual_q_rad`, `target_q_rad`, `position_rad`); what has no
meaning of its own is kept under its heading, in SI where its unit is known. `host_s` is the time of the table, from the
first row of all tables where it counts from 1970; `device_s` is a column of that name, or the same.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.plausible import value_fault
from acquisition.recording.foreign.column_meanings import POSE_MATRIX, TIME, UNUSED, Group, name_of, prefix_of
from acquisition.recording.foreign.column_statements import clauses
from acquisition.recording.foreign.conversion import (
    EPOCH_S,
    Exact,
    Understanding,
    converted,
    is_dated,
    seconds_since,
    times_of,
    understand,
)
from acquisition.recording.foreign.heading_units import folded, si_symbol, unit_of
from acquisition.recording.foreign.ros_topics import ROS_1, read_bag
from acquisition.recording.foreign.sheet import Sheet
from acquisition.recording.foreign.sheet_files import SUFFIXES, read_sheet
from acquisition.recording.foreign.sheet_times import check_times
from acquisition.recording.mcap.layout import STREAMS_NOTE
from acquisition.recording.recording import Channel, Recording, Stamps, Stream, check_declaration
from acquisition.recording.sample_rules import no_samples

BAG_SUFFIXES = (".db3", ".mcap", ROS_1)
TABLE, BAG = "table", "bag"
KINDS: Mapping[str, str] = {**dict.fromkeys(SUFFIXES, TABLE), **dict.fromkeys(BAG_SUFFIXES, BAG)}  # by suffix
_JOINT_CHANNELS: Mapping[str, str] = {
    "q": "actual_q_rad",
    "cmd": "target_q_rad",
    "enc": "position_rad",
    "qd": "actual_qd_rad_s",
    "tau": "joint_torque_nm",
    "motor_tau": "motor_torque_nm",
}
_UNITS: Mapping[str, str] = {"qd": "rad/s", "tau": "Nm", "motor_tau": "Nm"}  # else rad
DEVICE_S = "device_s"


@dataclass(frozen=True)
class LogStart:
    """What the times of all logs count from: `base` in each one's own unit, and the date that is, if it is one."""

    bases: tuple[Exact, ...]
    started_utc: datetime | None


def read_log(path: Path, sheet: str | None = None, header_row: int | None = None) -> tuple[Sheet, ...]:
    """The table of a file, or of each topic of a bag. SamplesError, RecordingError naming what cannot be read."""
    is_bag = path.is_dir() or KINDS.get(path.suffix.lower()) == BAG
    return tuple(read_bag(path)) if is_bag else (read_sheet(path, sheet, header_row),)


def understand_logs(sheets: Sequence[Sheet], rig_text: str, rig_name: str, columns: str) -> tuple[Understanding, ...]:
    """What each table means. A clause of `columns` holds for the tables that have its headings.

    SamplesError for a clause of no table, a table without a time, two tables of one meaning, and where no table has a
    column that is understood as more than a time.
    """
    names = [stream_name(sheet) for sheet in sheets]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SamplesError(f"two logs are named '{shown(twice, 40)}'; rename one of the files")
    stated = clauses(columns)
    used: set[int] = set()
    tables: list[Understanding] = []
    for sheet in sheets:
        own = {k: clause.text for k, clause in enumerate(stated) if clause.is_of(sheet, stream_name(sheet))}
        used |= set(own)
        tables.append(understand(sheet, rig_text, rig_name, ", ".join(own.values()), whole_rows=False))
    known = any(_is_known(group) for table in tables for group in table.groups)
    if lost := next((clause for k, clause in enumerate(stated) if k not in used), None):
        raise SamplesError(f"--columns: no log has the headings of '{shown(lost.text, 60)}'; correct them")
    for meaning in _JOINT_CHANNELS:
        both = [t for t in tables if any(group.meaning == meaning for group in t.groups)]
        if len(both) > 1:
            first, second = (stream_name(t.sheet) for t in both[:2])
            raise SamplesError(
                f"'{shown(first, 40)}' and '{shown(second, 40)}' both hold joint angles understood as {meaning}; state "
                f'what one of them is: --columns "{shown(second, 40)}: A1..A6 [deg] = enc"'
            )
    tables = [_with_own_channels(table) for table in tables]
    if not known:
        _refuse_unknown(tables)
    return tuple(tables)


def _refuse_unknown(tables: Sequence[Understanding]) -> None:
    """SamplesError naming what the files hold, of which nothing is understood."""
    headings = [h for table in tables for c, h in enumerate(table.sheet.headings) if h and not _is_time(table, c)]
    topics = [one.says for table in tables for one in table.sheet.not_taken]
    rows = sum(len(table.sheet.rows) for table in tables)
    arm = tables[0].rig.n_joints
    example = f"A1..A{arm} [deg] = q" if arm else f"E1..E{tables[0].rig.n_encoders} [deg] = enc"
    raise SamplesError(
        f"{tables[0].sheet.place()}: no joint angles, commands, encoders or measurement are understood; in {rows} rows "
        f'there are {shown(", ".join((*headings, *topics)), 110)}; state what they are: --columns "{example}"'
    )


def _is_time(table: Understanding, column: int) -> bool:
    of_time = any(group.meaning == TIME and column in group.columns for group in table.groups)
    return of_time or folded(name_of(table.sheet, column)) in ("device", "devices")


def stream_name(sheet: Sheet) -> str:
    """Of a file its name without suffix, of a bag's topic the topic, in letters that a stream may have."""
    name = re.sub(r"[^A-Za-z0-9_]+", "-", (sheet.name if sheet.name.startswith("/") else sheet.path.stem)).strip("-")
    return name if name[:1].isalpha() else f"log-{name}".rstrip("-")


def recording_of(
    tables: Sequence[Understanding], path: Path, stamps: Stamps = "unknown"
) -> tuple[Recording, datetime | None]:
    """The streams of all logs as one recording without samples, and when it began, where a calendar has it.

    `stamps`: what their times are, as the user states it.

    SamplesError where their times have nothing in common.
    """
    start = _start(tables)
    each = zip(tables, start.bases, strict=True)
    streams = [replace(_stream(table, base), stamps=stamps) for table, base in each]
    first = tables[0]
    recording = Recording(
        path=path,
        rig_text=first.rig_text,
        rig=first.rig,
        samples=no_samples(first.rig),
        complete=True,
        streams={stream.name: stream for stream in streams},
        notes={STREAMS_NOTE: ", ".join(stream.name for stream in streams)},
    )
    return recording, start.started_utc


def _is_known(group: Group) -> bool:
    """Whether a diagnosis can use it, or a person has named it."""
    return group.measures or group.meaning in _JOINT_CHANNELS or group.is_temperature or _is_named(group)


def _is_named(group: Group) -> bool:
    return group.kept and group.meaning not in (UNUSED, DEVICE_S)


def _with_own_channels(table: Understanding) -> Understanding:
    """With every column of numbers that has no meaning yet, under its own name."""
    sheet = table.sheet
    if not any(group.meaning == TIME for group in table.groups):
        raise SamplesError(
            f"{sheet.place()}: no column is understood as the time of each row; state which it is: "
            '--columns "Time [ms] = time"'
        )
    taken = {column for group in table.groups for column in group.columns}
    groups, numbers = list(table.groups), dict(table.numbers)
    for column, numeric in enumerate(sheet.numeric):
        if column in taken or not numeric or not sheet.headings[column]:
            continue
        name = re.sub(r"[^A-Za-z0-9]+", "_", name_of(sheet, column)).strip("_")
        unit = table.unit_in(column)
        known = unit_of(unit)
        ending = f"_{known.suffix}" if known is not None else ""
        name = f"{name if name[:1].isalpha() else f'column_{name}'}".rstrip("_") + ending
        groups.append(Group(name, (column,), unit, stated=True))
        numbers[column] = np.array(sheet.numbers(column), dtype=np.float64)
    return replace(table, groups=tuple(groups), numbers=numbers)


def _start(tables: Sequence[Understanding]) -> LogStart:
    """One moment for all clocks that count from 1970, else 0. SamplesError for tables of times apart."""
    ends: list[tuple[float, float]] = []
    units: list[float] = []
    for table in tables:
        group = _time_group(table)
        times = times_of(table.sheet, group.columns[0])
        if not times:
            raise SamplesError(f"{table.sheet.place()}: the table has no row; leave it out")
        check_times(table.sheet, group.columns[0], times, unit_of(group.unit))
        unit = unit_of(group.unit)
        units.append(1.0 if unit is None else unit.factor)
        ends.append((float(min(times)) * units[-1], float(max(times)) * units[-1]))
    latest, earliest = max(begin for begin, _ in ends), min(end for _, end in ends)
    if latest > earliest:
        one, two = (next(t for t, e in zip(tables, ends, strict=True) if at in e) for at in (earliest, latest))
        raise SamplesError(
            f"{stream_name(one.sheet)} ends at {earliest:.12g} s, {stream_name(two.sheet)} begins at {latest:.12g} s: "
            "logs of one session count from one moment; correct the column of time, or import them one by one"
        )
    begin_s = math.floor(min(begin for begin, _ in ends))
    if begin_s <= EPOCH_S:
        return LogStart((0,) * len(tables), None)
    bases = tuple(Decimal(begin_s) / Decimal(repr(unit)) for unit in units)
    dated = any(is_dated(table.sheet, _time_group(table).columns[0]) for table in tables)  # whose zone nobody states
    return LogStart(tuple(map(_whole, bases)), None if dated else datetime.fromtimestamp(begin_s, UTC))


def _whole(value: Decimal) -> Exact:
    """As int where it is one: differences of ints are exact, too, and faster."""
    return int(value) if value == value.to_integral_value() else value


def _stream(table: Understanding, base: Exact) -> Stream:
    sheet = table.sheet
    time_group = _time_group(table)
    host_s = seconds_since(times_of(sheet, time_group.columns[0]), base, time_group)
    channels: list[Channel] = []
    values: dict[str, NDArray[Any]] = {}
    for group in table.groups:
        if group.meaning in (TIME, UNUSED):
            continue
        for channel, array in _channels(table, group):
            _check_values(table, group, channel, array)
            channels.append(channel)
            values[channel.name] = array
    device_s = host_s
    if DEVICE_S in values:
        stamps_s = values.pop(DEVICE_S)
        channels = [channel for channel in channels if channel.name != DEVICE_S]
        if not np.all(np.isnan(stamps_s)):  # else it was never set
            from_1970 = np.nanmax(np.abs(stamps_s)) > EPOCH_S
            device_s = stamps_s - (float(base) * _factor(time_group) if from_1970 else 0.0)
    name = stream_name(sheet)
    try:
        check_declaration(name, tuple(channels))
    except ValueError as error:
        raise SamplesError(f"{sheet.place()}: {shown(str(error), 160)}; rename a column") from error
    return Stream(name, tuple(channels), host_s, device_s, np.arange(len(host_s), dtype=np.int64), values)


def _check_values(table: Understanding, group: Group, channel: Channel, values: NDArray[Any]) -> None:
    """SamplesError for a value that the quantity cannot have; a unit that a person has stated does not change that."""
    fault = value_fault(channel.name, values)
    if fault is not None:
        row, element, says = fault
        place = group.joints.index(element + 1) if group.joints else element
        column = group.columns[min(place, len(group.columns) - 1)]
        raise SamplesError(f"{table.sheet.place(row, column)}: {says}")


def _channels(table: Understanding, group: Group) -> Iterator[tuple[Channel, NDArray[Any]]]:
    values = converted(table, group)
    prefix = prefix_of(group.meaning)
    if group.meaning in _JOINT_CHANNELS:
        if group.joints:
            some, values = values, np.full((len(values), table.rig.n_encoders), np.nan)
            values[:, np.array(group.joints) - 1] = some
        yield Channel(_JOINT_CHANNELS[group.meaning], _UNITS.get(group.meaning, "rad"), values.shape[1:]), values
    elif group.meaning.endswith(("position", POSE_MATRIX)):
        yield Channel(f"{prefix}position_m", "m", (3,)), values[:, :3]
        if values.shape[1] == 6:
            yield Channel(f"{prefix}rotation_rad", "rad", (3,)), values[:, 3:]
    elif values.shape[1] == 3:
        yield Channel(f"{prefix}rotation_rad", "rad", (3,)), values
    else:
        unit = si_symbol(group.suffix) or group.unit
        for name, column in zip(group.targets(table.rig.n_encoders), values.T, strict=True):
            yield Channel(name, unit), column


def _time_group(table: Understanding) -> Group:
    return next(group for group in table.groups if group.meaning == TIME)


def _factor(group: Group) -> float:
    unit = unit_of(group.unit)
    return 1.0 if unit is None else unit.factor
