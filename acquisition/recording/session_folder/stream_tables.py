"""The folder `streams` of a session folder: every stream as a table, with what no table holds in streams.json.

`streams.json` names channels with unit, shape and resolution, the start of the session and its notes; what a recording
was exported to is then read back bit for bit. Without it each table is a stream of another program: a column `host_s`
(or `t_s`), and every other column a channel of its own, its unit the end of its name.
"""

import csv
import importlib
import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.files.bounds import (
    BY_UNIT,
    COUNT,
    TIME_S,
    Few,
    Instant,
    Label,
    Many,
    Name,
    NotNegative,
    Sentence,
)
from acquisition.recording.files.json_file import JsonKind, read_json
from acquisition.recording.files.plausible import time_fault, value_fault
from acquisition.recording.files.table_file import check_cells, parquet_table
from acquisition.recording.recording import (
    Channel,
    Event,
    Gap,
    Recording,
    Stamps,
    Stream,
    check_declaration,
    scalar_names,
)
from acquisition.recording.session_folder.tables import EVENTS, GAPS, TableFormat, table_name, write_tables

FOLDER, ABOUT = "streams", "streams.json"
KIND = JsonKind(ABOUT, "export the recording again with --streams", "export the recording again", RecordingError)
CLOCKS = ("host_s", "device_s", "sequence")
NOT_A_NUMBER = ("", "NaN", "nan", "NA")  # cells that other programs write where there is no reading


class ChannelAbout(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One channel as declared; `whole`: its numbers are 64-bit integers."""

    name: Name
    unit: Label = ""
    shape: Annotated[tuple[Annotated[int, msgspec.Meta(ge=1, le=1000)], ...], msgspec.Meta(max_length=4)] = ()
    resolution: NotNegative = 0.0
    full_scale: NotNegative | None = None  # None: infinite
    whole: bool = False


class StreamAbout(msgspec.Struct, frozen=True, kw_only=True):
    """One stream: its name and channels; its table is `<name>.csv` or `.parquet`."""

    name: Name
    channels: Many[ChannelAbout]
    stamps: Stamps | msgspec.UnsetType = msgspec.UNSET  # where it is known


class StreamsAbout(msgspec.Struct, frozen=True, kw_only=True):
    """Content of streams.json."""

    schema: Literal[1] = 1
    kind: Literal["calibeam-streams"] = "calibeam-streams"
    software: Label
    host: Label
    started_utc: Label
    host_s0: Instant
    complete: bool
    notes: dict[Name, Sentence]
    streams: Few[StreamAbout]


def write_streams(recording: Recording, folder: Path, kind: TableFormat) -> list[Path]:
    """Tables of all streams, events and gaps, and streams.json, into the folder `streams` that is made in `folder`."""
    folder = folder / FOLDER
    folder.mkdir()
    about = StreamsAbout(
        software=recording.software,
        host=recording.host,
        started_utc=recording.started_utc,
        host_s0=recording.host_s0,
        complete=recording.complete,
        notes=dict(recording.notes),
        streams=tuple(
            StreamAbout(
                name=stream.name,
                channels=tuple(_about(stream, channel) for channel in stream.channels),
                stamps=msgspec.UNSET if stream.stamps == "unknown" else stream.stamps,
            )
            for stream in recording.streams.values()
        ),
    )
    written = write_tables(recording, folder, kind)
    try:
        (folder / ABOUT).write_bytes(msgspec.json.format(msgspec.json.encode(about)))
    except OSError as error:
        raise RecordingError(f"{folder / ABOUT}: cannot be written ({error.strerror}); free space") from error
    return [*written, folder / ABOUT]


def with_streams(recording: Recording, folder: Path) -> Recording:
    """The recording of a session folder with what stands in its folder `streams`, if it has one.

    RecordingError where a table cannot be read, naming file, row and column.
    """
    folder = folder / FOLDER
    if not folder.is_dir():
        return recording
    gaps = _gaps(folder)
    if not (folder / ABOUT).is_file():
        found = [path for path in sorted(folder.iterdir()) if path.suffix in (".csv", ".parquet")]
        for one, other in pairwise(found):
            if one.stem == other.stem:
                raise RecordingError(f"{folder}: both {one.name} and {other.name} are there; remove one of them")
        streams = [_foreign(path, gaps) for path in found if path.stem not in (EVENTS, GAPS)]
        return replace(recording, streams={s.name: s for s in streams}, events=_events(folder))
    about = read_json(folder / ABOUT, KIND, StreamsAbout, _other)
    streams = [_declared(folder, stream, gaps) for stream in about.streams]
    return replace(
        recording,
        complete=about.complete,
        software=about.software,
        host=about.host,
        started_utc=about.started_utc,
        host_s0=about.host_s0,
        notes=about.notes,
        streams={s.name: s for s in streams},
        events=_events(folder),
    )


def _about(stream: Stream, channel: Channel) -> ChannelAbout:
    return ChannelAbout(
        name=channel.name,
        unit=channel.unit,
        shape=channel.shape,
        resolution=channel.resolution,
        full_scale=channel.full_scale if math.isfinite(channel.full_scale) else None,
        whole=stream.values[channel.name].dtype.kind == "i",
    )


def _other(content: dict[str, Any]) -> str | None:
    if content.get("kind") != "calibeam-streams":
        return f"no {ABOUT} of calibeam (kind is not calibeam-streams); {KIND.again}"
    schema = content.get("schema")
    return None if schema == 1 else f"schema = {shown(schema)}: this program reads version 1; {KIND.again}"


def _declared(folder: Path, about: StreamAbout, gaps: Mapping[str, tuple[Gap, ...]]) -> Stream:
    channels = tuple(
        Channel(c.name, c.unit, c.shape, math.inf if c.full_scale is None else c.full_scale, c.resolution)
        for c in about.channels
    )
    _check_names(folder / ABOUT, about.name, channels)
    path = _path_of(folder, table_name(about.name))
    whole = [
        name for c, channel in zip(about.channels, channels, strict=True) if c.whole for name in scalar_names(channel)
    ]
    columns = _columns(path, whole=("sequence", *whole))
    values: dict[str, NDArray[Any]] = {}
    for channel in channels:
        missing = [name for name in scalar_names(channel) if name not in columns]
        if missing:
            raise RecordingError(f"{path}: no column '{missing[0]}', which {ABOUT} declares; {KIND.again}")
        values[channel.name] = np.stack([columns[name] for name in scalar_names(channel)], axis=1).reshape(
            -1, *channel.shape
        )
    return replace(_stream(path, about.name, channels, columns, values, gaps), stamps=about.stamps or "unknown")


def _foreign(path: Path, gaps: Mapping[str, tuple[Gap, ...]]) -> Stream:
    columns = _columns(path, whole=("sequence",))
    if "host_s" not in columns and "t_s" in columns:
        columns["host_s"] = columns.pop("t_s")
    if "sequence" not in columns:
        columns["sequence"] = np.arange(len(next(iter(columns.values()), ())), dtype=np.int64)
    names = [name for name in columns if name not in CLOCKS]
    channels = tuple(Channel(name, _unit(name)) for name in names)
    _check_names(path, path.stem, channels)
    return _stream(path, path.stem, channels, columns, {name: columns[name] for name in names}, gaps)


def _stream(
    path: Path,
    name: str,
    channels: tuple[Channel, ...],
    columns: Mapping[str, NDArray[Any]],
    values: Mapping[str, NDArray[Any]],
    gaps: Mapping[str, tuple[Gap, ...]],
) -> Stream:
    if "host_s" not in columns:
        raise RecordingError(f"{path}: no column 'host_s'; a stream needs the time of each row, host_s or t_s, in s")
    if "sequence" not in columns:
        raise RecordingError(f"{path}: no column 'sequence', which numbers the rows; {KIND.again}")
    host_s = columns["host_s"]
    device_s = columns.get("device_s", np.full(len(host_s), math.nan))
    if np.any(missing := np.isnan(host_s)):
        row = int(np.argmax(missing))
        raise RecordingError(f"{path} row {row + 1}, column 'host_s': nan; a time is a number of seconds")
    if (fault := time_fault(host_s)) is not None:
        raise RecordingError(f"{path} row {fault[0] + 1}, column 'host_s': {fault[1]}")
    if np.any(bad := np.abs(device_s) > TIME_S):  # of any clock, which may have been set
        row = int(np.argmax(bad))
        raise RecordingError(f"{path} row {row + 1}, column 'device_s': {device_s[row]}; at most {TIME_S:g} s")
    exported = (path.parent / ABOUT).is_file()
    for channel in channels:
        if (found := value_fault(channel.name, values[channel.name], infinite=exported)) is not None:
            row, element, says = found
            raise RecordingError(f"{path} row {row + 1}, column '{scalar_names(channel)[element]}': {says}")
    return Stream(name, channels, host_s, device_s, columns["sequence"], values, gaps.get(name, ()))


def _columns(path: Path, *, whole: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Every column as float64, those of `whole` as int64; an empty cell is NaN, and refused in a whole one."""
    table = _table(path, NOT_A_NUMBER)
    out: dict[str, NDArray[Any]] = {}
    for name in table.column_names:
        try:
            wanted = "int64" if name in whole else "float64"
            column = table[name].combine_chunks().cast(wanted)
        except ValueError as error:  # pyarrow.ArrowInvalid, and what it does not implement
            raise _bad_cell(path, name, table[name].to_pylist(), whole=name in whole) from error
        except NotImplementedError as error:
            raise RecordingError(f"{path}, column '{shown(name)}': no column of numbers; remove it") from error
        if name in whole and column.null_count:
            raise _bad_cell(path, name, column.to_pylist(), whole=True)
        out[name] = column.to_numpy(zero_copy_only=False).astype(wanted)
    return out


def _table(path: Path, empty: tuple[str, ...] = ("",)) -> Any:
    """A pyarrow table; of CSV all columns as text, since guessed types lose digits and kinds of numbers."""
    try:
        if path.suffix == ".parquet":
            table = parquet_table(path, RecordingError, plain=False)
            _check_once(path, table.column_names)  # names that are no UTF-8 are an error only here
            return table
        text = importlib.import_module("pyarrow.csv")
        types = dict.fromkeys(_header(path), importlib.import_module("pyarrow").string())
        options = text.ConvertOptions(column_types=types, strings_can_be_null=True, null_values=list(empty))
        return text.read_csv(path, convert_options=options)
    except (OSError, ValueError, csv.Error) as error:  # pyarrow.ArrowInvalid is a ValueError
        raise RecordingError(f"{path}: cannot be read as a table ({shown(str(error))}); write it again") from error


def _header(path: Path) -> list[str]:
    with path.open(encoding="utf-8", newline="") as file:
        names = next(csv.reader(file), [])
    check_cells(f"{path} line 1", len(names), 0, RecordingError)
    _check_once(path, names)
    return names


def _check_once(path: Path, names: list[str]) -> None:
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RecordingError(f"{path}: column '{shown(twice)}' stands twice; rename or remove one")


def _bad_cell(path: Path, column: str, cells: list[Any], *, whole: bool) -> RecordingError:
    for row, cell in enumerate(cells, start=1):
        if not _fits(cell, whole=whole):
            given = "an empty cell" if cell is None else shown(cell)
            wanted = "a whole number" if whole else "a number"
            return RecordingError(f"{path} row {row}, column '{shown(column)}': {given} is not {wanted}; correct it")
    return RecordingError(f"{path}, column '{shown(column)}': not all cells are numbers; correct or remove the column")


def _fits(cell: Any, *, whole: bool) -> bool:
    if cell is None:
        return not whole
    try:
        float(cell)
        return not whole or int(cell) == cell or isinstance(cell, str)
    except (ValueError, TypeError, OverflowError):
        return False


def _events(folder: Path) -> tuple[Event, ...]:
    rows = _rows(folder, EVENTS, ("host_s", "kind", "detail_json"))
    out: list[Event] = []
    for number, row in enumerate(rows, start=1):
        try:
            detail = msgspec.json.decode(str(row["detail_json"]).encode(), type=dict[str, Any])
            out.append(Event(_time(row["host_s"]), str(row["kind"] or ""), detail))
        except (msgspec.DecodeError, RecursionError, ValueError, TypeError) as error:
            raise RecordingError(
                f"{folder / EVENTS} row {number}: no event ({shown(str(error))}); {KIND.again}"
            ) from error
    return tuple(out)


def _gaps(folder: Path) -> dict[str, tuple[Gap, ...]]:
    out: dict[str, list[Gap]] = {}
    for number, row in enumerate(_rows(folder, GAPS, ("stream", "from_s", "to_s", "missing", "reason")), start=1):
        try:
            gap = Gap(_time(row["from_s"]), _time(row["to_s"]), _missing(row["missing"]), str(row["reason"] or ""))
        except (ValueError, TypeError, OverflowError) as error:
            raise RecordingError(f"{folder / GAPS} row {number}: no gap ({shown(str(error))}); {KIND.again}") from error
        out.setdefault(str(row["stream"]), []).append(gap)
    return {name: tuple(gaps) for name, gaps in out.items()}


def _missing(cell: Any) -> int:
    count = int(cell)
    if not -1 <= count <= COUNT:
        raise ValueError(f"{count} is no number of samples")
    return count


def _rows(folder: Path, name: str, wanted: tuple[str, ...]) -> list[dict[str, Any]]:
    path = next((p for p in (folder / f"{name}.csv", folder / f"{name}.parquet") if p.is_file()), None)
    if path is None:
        return []
    table = _table(path)
    missing = [column for column in wanted if column not in table.column_names]
    if missing:
        raise RecordingError(f"{path}: no column '{missing[0]}'; {KIND.again}")
    check_cells(str(path), 0, 8 * table.num_rows + table.nbytes // 2, RecordingError)  # as much as their objects take
    return table.to_pylist()


def _time(cell: Any) -> float:
    value = float(cell)
    if not abs(value) <= TIME_S:
        raise ValueError(f"{value} is no time in s")
    return value


def _path_of(folder: Path, name: str) -> Path:
    for kind in TableFormat:
        if (path := folder / f"{name}.{kind.value}").is_file():
            return path
    raise RecordingError(f"{folder}: no {name}.csv or {name}.parquet, which {ABOUT} names; {KIND.again}")


def _check_names(path: Path, name: str, channels: tuple[Channel, ...]) -> None:
    try:
        check_declaration(name, channels)
    except ValueError as error:
        raise RecordingError(f"{path}: {shown(str(error), 200)}") from error


def _unit(name: str) -> str:
    found = [unit for unit in BY_UNIT if name.endswith(unit)]
    return max(found, key=len, default="").removeprefix("_").replace("_", "/")
