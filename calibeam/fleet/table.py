"""fleet.parquet: one row a recording, one column a number; reads back to the same rows."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from acquisition.recording import RecordingError
from acquisition.recording.files import shown
from calibeam.fleet.row import Row

VERSION = b"2"
KEY = b"calibeam.fleet"
PLAIN = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
NESTED = {
    "instruments": pa.list_(pa.string()),
    "causes": pa.list_(
        pa.struct(
            [
                *((name, pa.string()) for name in ("where", "depends_on", "shape", "physics")),
                *((name, pa.float64()) for name in ("confidence", "share")),
                ("says", pa.string()),
            ]
        )
    ),
}
RADIANS = ("joint", "orientation")  # sources of noise that are angles; all others are lengths
ZERO = (("value_rad", "zero_rad", pa.float64()), ("sigma_rad", "zero_sigma_rad", pa.float64()))
STATUS = ("status", "zero_status", pa.string())
DRAWN = ("drawn_rad", "drawn_rad", pa.float64())


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """All rows in the order of their names, the file whole or as it was before. RecordingError if the disk refuses."""
    plain = [msgspec.to_builtins(row) for row in sorted(rows, key=lambda row: row.name)]
    joints = range(1, max((zero.joint for row in rows for zero in row.zeros), default=0) + 1)
    sources = sorted({source for row in rows for source in row.noise})
    columns: dict[str, pa.Array] = {}
    for name, kind in _kinds().items():
        columns[name] = pa.array([row.get(name) for row in plain], type=kind)
    for source in sources:
        columns[_noise_name(source)] = pa.array([row["noise"].get(source) for row in plain], type=pa.float64())
    for joint in joints:
        zeros = [next((z for z in row["zeros"] if z["joint"] == joint), {}) for row in plain]
        for key, name, kind in (*ZERO, STATUS, DRAWN):
            columns[f"joint{joint}_{name}"] = pa.array([z.get(key) for z in zeros], type=kind)
    table = pa.table(columns).replace_schema_metadata({KEY: VERSION})
    partial = path.with_name(path.name + ".partial")
    try:
        pq.write_table(table, partial)
        partial.replace(path)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror or error}); free space there") from error


def read_rows(path: Path) -> list[Row]:
    """The rows of an earlier run, none where there is no file. RecordingError for a file of another kind."""
    if not path.exists():
        return []
    try:
        table = pq.read_table(path)
        if (table.schema.metadata or {}).get(KEY) != VERSION:
            raise ValueError("not a table of this program, or of another version of it")
        return [_row(plain) for plain in table.to_pylist()]
    except (OSError, ValueError, KeyError) as error:  # pyarrow.ArrowInvalid and msgspec's errors are ValueErrors
        raise RecordingError(
            f"{path}: cannot be continued ({shown(str(error))}); choose another --out, or remove the file"
        ) from error


def _kinds() -> dict[str, Any]:
    """Arrow type of every field that is one column."""
    kinds: dict[str, Any] = {}
    for field in msgspec.structs.fields(Row):
        if field.name in ("zeros", "noise"):
            continue
        stated = get_args(field.type)[0] if get_origin(field.type) is Annotated else field.type
        kind = float if field.name.endswith("_m") else stated
        kinds[field.name] = NESTED.get(field.name, PLAIN.get(kind, pa.string()))
    return kinds


def _noise_name(source: str) -> str:
    return f"noise_{source}_{'rad' if source.startswith(RADIANS) else 'm'}"


def _row(plain: dict[str, Any]) -> Row:
    fields = {name: plain[name] for name in _kinds()}
    fields["noise"] = {
        name.removeprefix("noise_").rpartition("_")[0]: value
        for name, value in plain.items()
        if name.startswith("noise_") and value is not None
    }
    fields["zeros"] = list(_zeros(plain))
    return msgspec.convert(fields, Row)


def _zeros(plain: dict[str, Any]) -> Iterable[dict[str, Any]]:
    joint = 1
    while f"joint{joint}_zero_status" in plain:
        if plain[f"joint{joint}_zero_status"] is not None:
            yield {"joint": joint, **{key: plain[f"joint{joint}_{name}"] for key, name, _ in (*ZERO, STATUS, DRAWN)}}
        joint += 1
