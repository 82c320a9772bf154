"""The one way in which a result becomes a file: never over a measurement, an input or a result of another kind.

A file is written beside its place under a name that nobody can foresee, synced, and renamed: a full disk, Ctrl-C or a
power cut leaves what was there before. A command states with `command_files` which files it reads, and whether the
user permits to replace files of other kinds; without a command (a script that imports the package) there is no such
permission.
"""

import csv
import io
import os
import stat
import tempfile
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import msgspec

from acquisition.recording.errors import RecordingError

MCAP_MAGIC = b"\x89MCAP0\r\n"  # https://mcap.dev/spec#magic
HEAD_BYTES = 65_536  # of a text, in which its mark stands
LARGEST_BYTES = 64_000_000  # of a JSON or TOML result: a larger file is none
REMEDY = "choose another --out"


class OutputError(RecordingError):
    """A file that may not be written, or not be replaced; the message names it, what it is, and the remedy."""


@dataclass(frozen=True)
class OutputKind:
    """A kind of result: its name in errors, and whether an existing file is an earlier one of it."""

    name: str
    is_one: Callable[[Path], bool]


@dataclass(frozen=True)
class _CommandFiles:
    inputs: tuple[tuple[Path, tuple[int, int]], ...] = ()  # each with its device and inode
    force: bool | None = field(default=None)  # None: outside a command that has the option


_COMMAND: ContextVar[_CommandFiles] = ContextVar("command_files", default=_CommandFiles())  # noqa: B039 - frozen


@contextmanager
def command_files(inputs: Iterable[Path], *, force: bool) -> Generator[None]:
    """The files that a command reads, which it may not replace; `force`: it may replace files of other kinds."""
    known = [(path, (found.st_dev, found.st_ino)) for path in inputs if (found := _status(path)) is not None]
    before = _COMMAND.set(_CommandFiles(tuple(known), force))
    try:
        yield
    finally:
        _COMMAND.reset(before)


def refuse_output(path: Path, kind: OutputKind) -> None:
    """OutputError where `path` may not become a file of this kind; called before a long calculation, too."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}); {REMEDY}") from error
    if stat.S_ISDIR(found.st_mode):
        raise OutputError(f"{path}: is a folder; give the name of a file in it")
    if stat.S_ISLNK(found.st_mode):
        raise OutputError(f"{path}: is a link, and links are not followed; give the file itself, or {REMEDY}")
    if not stat.S_ISREG(found.st_mode):
        raise OutputError(f"{path}: is no regular file; {REMEDY}")
    command = _COMMAND.get()
    if any((found.st_dev, found.st_ino) == identity for _, identity in command.inputs):
        raise OutputError(f"{path}: this command reads it, and does not write over it; {REMEDY}")
    if _head(path).startswith(MCAP_MAGIC):
        raise OutputError(f"{path}: is a recording, and no recording is written over; {REMEDY}")
    if not command.force and found.st_size and not kind.is_one(path):
        remedy = "move it away" if command.force is None else f"{REMEDY}, or replace it with --force"
        raise OutputError(f"{path}: the file is there already and is no {kind.name}; {remedy}")


def write_output(path: Path | str, content: bytes | str, kind: OutputKind) -> Path:
    """Write a whole file, text as UTF-8; returns its path.

    OutputError where it may not be replaced; OSError, with its path, where the disk or the folder refuses: then what
    was there before is untouched.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    refuse_output(path, kind)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _replace(path, data)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    return path


def json_output(kind: str, name: str = "") -> OutputKind:
    """A JSON object, or a list of them, that holds `kind` and a `schema`."""

    def is_one(path: Path) -> bool:
        document = _parsed(path, msgspec.json.decode)
        first = cast("list[Any]", document)[0] if isinstance(document, list) and document else document
        return isinstance(first, dict) and "schema" in first and cast("dict[str, Any]", first).get("kind") == kind

    return OutputKind(name or f"file of kind {kind}", is_one)


def toml_output(keys: Sequence[str], name: str) -> OutputKind:
    """A TOML file with these keys at its top."""

    def is_one(path: Path) -> bool:
        document = _parsed(path, msgspec.toml.decode)
        return isinstance(document, dict) and set(keys) <= document.keys()

    return OutputKind(name, is_one)


def text_output(mark: str, name: str) -> OutputKind:
    """A text that holds the mark near its beginning."""
    return OutputKind(name, lambda path: mark.encode() in _head(path))


def table_output(columns: Sequence[str], name: str) -> OutputKind:
    """A CSV table with these columns."""

    def is_one(path: Path) -> bool:
        lines = _head(path).decode("utf-8", errors="replace").splitlines()
        return set(columns) <= set(lines[0].split(",")) if lines else False

    return OutputKind(name, is_one)


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Rows as CSV with the line ends of Unix."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _replace(path: Path, data: bytes) -> None:
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name[:100]}.", dir=path.parent)
    partial = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fchmod(descriptor, _mode(path))
            os.fsync(descriptor)
        partial.replace(path)
    except BaseException:
        with suppress(OSError):
            partial.unlink()
        raise
    _sync_folder(path.parent)


def _mode(path: Path) -> int:
    """Of the file that is replaced, or of a new one of this user."""
    if (found := _status(path)) is not None:
        return stat.S_IMODE(found.st_mode)
    mask = os.umask(0o077)
    os.umask(mask)
    return 0o666 & ~mask


def _sync_folder(folder: Path) -> None:
    with suppress(OSError):  # some network file systems refuse it; the file itself is on the disk
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except (OSError, ValueError):
        return None


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEAD_BYTES)
    except OSError as error:
        raise OutputError(f"{path}: is there already and cannot be read ({error.strerror}); {REMEDY}") from error


def _parsed(path: Path, decode: Callable[[bytes], Any]) -> Any:
    """None for a file that is none of this kind."""
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
        return decode(data) if len(data) <= LARGEST_BYTES else None
    except (OSError, ValueError, RecursionError):  # msgspec's errors are ValueErrors
        return None
