"""Streams, events and gaps of a recording as plain tables, Parquet or CSV: one file each, one row a sample.

A vector channel is one column for each element, `q_rad_1`, `q_rad_2`, ...; what is not a number is empty (null).
Numbers are written so that they read back bit for bit. Parquet columns carry their unit in the field's metadata.
"""

import enum
import importlib
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from acquisition.recording.errors import RecordingError
from acquisition.recording.recording import Recording
from acquisition.recording.stream import Channel, Stream, scalar_names

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
