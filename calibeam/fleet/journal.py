"""Rows on the disk as they come, one JSON line each: whatever ends a run, what was done is done.

At the end, and before the next run begins, the lines are merged into the table. One run at a time has the folder.
"""

import fcntl
from pathlib import Path
from typing import IO, Self

import msgspec

from acquisition.recording import RecordingError
from acquisition.recording.files import shown
from calibeam.fleet.layout import JOURNAL, TABLE
from calibeam.fleet.row import Row
from calibeam.fleet.table import read_rows, write_rows
from calibeam.recorded import uninterrupted


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
            raise RecordingError(f"{self._path}: cannot be written ({error.strerror}); free space there") from error

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
