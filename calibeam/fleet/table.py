"""The rows of a fleet on disk: fleet.parquet, and a journal while a run is not over.

The journal is one JSON line a row, so that a run that is killed loses nothing. At the end, and before the next run
begins, its lines are merged into the table. One run at a time has the folder.
"""

import fcntl
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO, Annotated, Any, Self, get_args, get_origin

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from acquisition.recording import RecordingError
from acquisition.recording.files import shown
from acquisition.recording.output import OutputKind, write_output
from calibeam.devices.recorder import uninterrupted
from calibeam.fleet.recordings import JOURNAL, TABLE
from calibeam.fleet.row import Row

VERSION = b"2"
OLDER_TRUST = {"good": "yes", "care": "with care", "bad": "no"}  # as tables of before December 2026 have it
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
    content = io.BytesIO()
    pq.write_table(table, content)
    try:
        write_output(path, content.getvalue(), OutputKind("table of a batch", _is_table))
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror or error}); make room on its disk") from error


def _is_table(path: Path) -> bool:
    try:
        return (pq.read_schema(path).metadata or {}).get(KEY) == VERSION
    except (OSError, ValueError):  # pyarrow.ArrowInvalid is a ValueError
        return False


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
    fields["trust"] = OLDER_TRUST.get(fields["trust"], fields["trust"])
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


class Journal:
    """Owner of a results folder: the newest row of every recording, by its path."""

    def __init__(self, out: Path) -> None:
        """Opens the folder, with what is in it. RecordingError where that cannot be, or another run has it."""
        self.table = out / TABLE
        self._path = out / JOURNAL
        try:
            out.mkdir(parents=True, exist_ok=True)
            self._file: IO[bytes] = self._path.open("a+b")
        except OSError as error:
            raise RecordingError(f"{out}: cannot be written ({error.strerror}); choose another --out") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._rows = {row.path: row for row in (*read_rows(self.table), *_lines(self._file))}
        except BlockingIOError:
            self._file.close()
            raise RecordingError(
                f"{out}: another batch is at work there; wait for it, or choose another --out"
            ) from None
        except RecordingError:
            self._file.close()
            raise

    @property
    def rows(self) -> tuple[Row, ...]:
        """All, of this run and of earlier ones."""
        return tuple(self._rows.values())

    def add(self, row: Row) -> None:
        """Keep a row in place of what stood for its path. RecordingError when the disk is full."""
        self._rows[row.path] = row
        try:
            self._file.write(msgspec.json.encode(row) + b"\n")
            self._file.flush()
        except OSError as error:
            raise RecordingError(
                f"{self._path}: cannot be written ({error.strerror}); make room on its disk"
            ) from error

    def forget(self, path: str) -> None:
        """The recording has its row under another path now: it lies elsewhere, or is part of a session."""
        self._rows.pop(path, None)

    def close(self) -> None:
        """Merge into the table; safe to call again."""
        with uninterrupted():
            if self._file.closed:
                return
            try:
                write_rows(self.table, self.rows)
                self._path.unlink(missing_ok=True)
            finally:
                self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _lines(file: IO[bytes]) -> list[Row]:
    """Rows of a run that was killed; a line torn in the middle is none."""
    file.seek(0)
    whole = [line for line in file if line.endswith(b"\n")]
    try:
        return [msgspec.json.decode(line, type=Row) for line in whole]
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordingError(
            f"{file.name}: damaged, or of another version of this program ({shown(str(error))}); remove it, or choose "
            "another --out"
        ) from error
