"""Plain tables, Parquet or CSV: streams, events and gaps, one file each, and the settled samples, one row each.

A vector channel is one column for each element, `q_rad_1`, `q_rad_2`, ...; what is not a number is empty (null).
Numbers are written so that they read back bit for bit. Parquet columns carry their unit in the field's metadata.
"""

import csv
import enum
import importlib
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from acquisition.recording.errors import RecordingError, SamplesError, shown
from acquisition.recording.files.bounds import TABLE_CELLS
from acquisition.recording.files.table_file import check_cells, parquet_table, table_bytes
from acquisition.recording.recording import Channel, Recording, Stream, scalar_names
from acquisition.recording.rig import Rig
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Cell, Samples, cells_of

EVENTS, GAPS = "events", "gaps"  # beside the streams, which may not be named so


class TableFormat(enum.Enum):
    """Kinds of files; the value is the suffix."""

    CSV = "csv"
    PARQUET = "parquet"


def write_tables(recording: Recording, folder: Path, kind: TableFormat) -> list[Path]:
    """Every stream, `events` and `gaps` into an existing folder; what was written. RecordingError if the disk refuses.

    Streams named "events" or "gaps" get a trailing underscore.
    """
    pa = _pyarrow("pyarrow")
    tables = {table_name(stream.name): stream_table(stream) for stream in recording.streams.values()}
    tables[EVENTS] = pa.table(
        {
            "host_s": pa.array([event.host_s for event in recording.events], pa.float64()),
            "kind": pa.array([event.kind for event in recording.events], pa.string()),
            "detail_json": pa.array(
                [msgspec.json.encode(event.detail).decode() for event in recording.events], pa.string()
            ),
        }
    )
    gaps = [(stream.name, gap) for stream in recording.streams.values() for gap in stream.gaps]
    tables[GAPS] = pa.table(
        {
            "stream": pa.array([name for name, _ in gaps], pa.string()),
            "from_s": pa.array([gap.from_s for _, gap in gaps], pa.float64()),
            "to_s": pa.array([gap.to_s for _, gap in gaps], pa.float64()),
            "missing": pa.array([gap.missing for _, gap in gaps], pa.int64()),
            "reason": pa.array([gap.reason for _, gap in gaps], pa.string()),
        }
    )
    return [_write(table, folder / f"{name}.{kind.value}", kind) for name, table in tables.items()]


def stream_table(stream: Stream) -> Any:
    """A pyarrow table: host_s, device_s, sequence, and every element of every channel."""
    pa = _pyarrow("pyarrow")
    clocks = (
        (pa.field("host_s", pa.float64(), metadata={"unit": "s"}), stream.host_s),
        (pa.field("device_s", pa.float64(), metadata={"unit": "s"}), stream.device_s),
        (pa.field("sequence", pa.int64()), stream.sequence),
    )
    columns = [*clocks, *(column for channel in stream.channels for column in _columns(pa, stream, channel))]
    arrays = [pa.array(values, field.type, from_pandas=True) for field, values in columns]  # NaN becomes null
    return pa.table(arrays, schema=pa.schema([field for field, _ in columns]))


def write_table(columns: dict[str, Any], path: Path, kind: TableFormat) -> None:
    """Columns of plain cells, None where missing, to one file. RecordingError if the disk refuses."""
    _write(_pyarrow("pyarrow").table(columns), path, kind)


def _columns(pa: Any, stream: Stream, channel: Channel) -> Iterable[tuple[Any, np.ndarray[Any, Any]]]:
    values = stream.values[channel.name].reshape(len(stream.host_s), math.prod(channel.shape))
    kind = pa.int64() if values.dtype.kind == "i" else pa.float64()
    for number, name in enumerate(scalar_names(channel)):
        yield (
            pa.field(name, kind, metadata={"unit": channel.unit, "resolution": repr(channel.resolution)}),
            np.ascontiguousarray(values[:, number]),
        )


def table_name(stream: str) -> str:
    """The table of a stream, without suffix."""
    return f"{stream}_" if stream in (EVENTS, GAPS) else stream


def _write(table: Any, path: Path, kind: TableFormat) -> Path:
    try:
        if kind is TableFormat.PARQUET:
            _pyarrow("pyarrow.parquet").write_table(table, path, compression="zstd")
        else:
            _pyarrow("pyarrow.csv").write_csv(table, path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the table ({error}); choose another place") from error
    return path


def _pyarrow(module: str) -> Any:
    """Loaded only here: a fit reads recordings without it."""
    return importlib.import_module(module)


def read_csv(path: Path | str, rig: Rig, *, joints_needed: bool = True) -> Samples:
    """The samples of a CSV file (UTF-8, header row, commas, empty = missing); without joints where none is needed.

    SamplesError naming file, row, column, value and remedy.
    """
    try:
        text = table_bytes(path, "samples", SamplesError).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SamplesError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    return parse_csv(text, str(path), rig, joints_needed=joints_needed)


def parse_csv(text: str, name: str, rig: Rig, *, joints_needed: bool = True) -> Samples:
    """The samples of a CSV text; `name` stands for the file in errors. SamplesError as for `read_csv`."""
    lines: list[int] = []
    columns: dict[str, list[Cell]] = {}
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        header = _header([cell.strip() for cell in next(reader, [])], name)
        columns = {column: [] for column in header}
        for cells in reader:
            if cells:  # a blank line, as at the end of many files, has no cells at all
                lines.append(reader.line_num)
                if (count := len(lines) * len(header)) > TABLE_CELLS:
                    check_cells(f"{name} line {reader.line_num}", len(header), count, SamplesError)
                _append(columns, cells, f"{name} row {len(lines)} (line {reader.line_num})")
    except csv.Error as error:
        raise SamplesError(f"{name} line {reader.line_num}: not CSV: {error}; correct the line") from error

    def place(row: int | None) -> str:
        return name if row is None else f"{name} row {row + 1} (line {lines[row]})"

    return checked_samples(columns, rig, place, joints_needed=joints_needed)


def write_csv(samples: Samples, path: Path) -> None:
    """Every cell so that it reads back bit for bit: the shortest text of a float, nothing for a missing cell.

    RecordingError when the disk refuses.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(samples.names)
    columns = [[_text(cell) for cell in cells_of(name, values)] for name, values in samples.columns.items()]
    writer.writerows(zip(*columns, strict=True))
    try:
        path.write_text(text.getvalue(), encoding="utf-8", newline="")
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the samples ({error.strerror}); choose another place") from error


def check_header(names: Iterable[str], file: str) -> None:
    """SamplesError for a column without a name, one that a spreadsheet computes, or a name that stands twice."""
    seen: set[str] = set()
    for number, column in enumerate(names, start=1):
        if not column:
            raise SamplesError(f"{file}: column {number} has no name; name it or remove it")
        if column[0] in "=+-@":
            raise SamplesError(f"{file}: column '{shown(column)}' would be a formula in a spreadsheet; rename it")
        if column in seen:
            raise SamplesError(f"{file}: column '{shown(column)}' stands twice; rename or remove one")
        seen.add(column)


def _header(names: list[str], file: str) -> list[str]:
    if not names:
        raise SamplesError(f"{file}: the file is empty; it needs a header row with t_s, q1_rad, ...")
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise SamplesError(f"{file} line 1: columns are not separated by commas; save as comma-separated")
    check_cells(f"{file} line 1", len(names), 0, SamplesError)
    check_header(names, file)
    return names


def _append(columns: dict[str, list[Cell]], cells: list[str], place: str) -> None:
    if len(cells) != len(columns):
        raise SamplesError(
            f"{place}: {len(cells)} cells under {len(columns)} columns; give every column a cell, and decimals a point"
        )
    for column, cell in zip(columns.values(), cells, strict=True):
        column.append(cell.strip() or None)


def _text(cell: Cell) -> str:
    return "" if cell is None else repr(cell) if isinstance(cell, float) else str(cell)


def read_parquet(path: Path, rig: Rig) -> Samples:
    """The samples of a Parquet file; null is a missing cell. SamplesError naming file, row, column and remedy."""
    try:
        table = parquet_table(path, SamplesError)
    except ImportError as error:
        raise SamplesError(
            f"{path}: reading Parquet needs pyarrow; pip install pyarrow, or give samples.csv"
        ) from error
    check_header(table.column_names, str(path))
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    return checked_samples(columns, rig, lambda row: str(path) if row is None else f"{path} row {row + 1}")


def write_parquet(samples: Samples, path: Path) -> None:
    """Every cell so that it reads back bit for bit, null for a missing one. RecordingError when the disk refuses."""
    columns = {name: cells_of(name, values) for name, values in samples.columns.items()}
    write_table(columns, path, TableFormat.PARQUET)
