"""Writes records as a JSON file, and reads them with one clear error that names file, key, value and remedy."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec

from acquisition.recording.errors import shown
from acquisition.recording.files.explain import located, plain
from acquisition.recording.output import json_output, write_output

T = TypeVar("T")

LARGEST_BYTES = 32_000_000  # a model of 1,000 parameters has a covariance of 20 MB
MOST_OBJECTS = 500_000  # each takes 64 bytes for two in the file
Check = Callable[[dict[str, Any]], str | None]
Renewal = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True)
class JsonKind:
    """A kind of file: its name in errors, what to do where it is missing, and where it is damaged."""

    name: str  # "model.json"
    give: str  # "give the model.json of an identification"
    again: str  # "identify the recording again"
    fault: type[Exception]


def read_json(path: Path, kind: JsonKind, records: type[T], other: Check, renewed: Renewal | None = None) -> T:
    """The records of a file. `kind.fault` where it cannot be read, is damaged, or out of the bounds of its records.

    `other` is given the top level and returns what is wrong with it as a whole: another kind, another version.
    `renewed` gives the top level of an earlier version its present keys.
    """
    data = _read(path, kind)
    if (count := data.count(b"{") + data.count(b"[")) > MOST_OBJECTS:
        raise kind.fault(f"{path}: {count} lists and objects, which no {kind.name} has; {kind.again}")
    try:
        data.decode("utf-8")
        document: Any = msgspec.json.decode(data)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise kind.fault(f"{path} line {line}: byte {error.start} is not UTF-8; {kind.again}") from error
    except RecursionError:
        raise kind.fault(f"{path}: not a {kind.name} (lists or objects hundreds deep); {kind.again}") from None
    except msgspec.DecodeError as error:
        raise kind.fault(f"{path}: not a {kind.name} ({shown(str(error))}); {kind.again}") from error
    if not isinstance(document, dict):
        raise kind.fault(f"{path}: not a {kind.name} (it holds no object); {kind.again}")
    content = cast("dict[str, Any]", document)
    if (says := other(content)) is not None:
        raise kind.fault(f"{path}: {says}")
    if renewed is not None:
        content = renewed(content)
    try:
        return msgspec.convert(content, type=records)
    except msgspec.ValidationError as error:
        place, says, value = located(error, content, records)
        key = ".".join(map(str, place)) or "the file"
        is_one = not isinstance(value, dict | list)
        spelled = f" = {shown(value, 80)}" if is_one else ""
        raise kind.fault(
            f"{path}: damaged {kind.name}: {shown(key, 80)}{spelled}: {shown(plain(says))}; {kind.again}"
        ) from error


def write_json(path: Path, records: object) -> None:
    """Records with `kind` and `schema`, or a sequence of them. OutputError, OSError as `write_output`."""
    first: Any = cast("Sequence[object]", records)[0] if isinstance(records, list | tuple) else records
    text = msgspec.json.format(msgspec.json.encode(records), indent=1)
    write_output(path, text + b"\n", json_output(first.kind))


def _read(path: Path, kind: JsonKind) -> bytes:
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise kind.fault(f"{path}: cannot be read ({error.strerror}); {kind.give}") from error
    if len(data) > LARGEST_BYTES:
        raise kind.fault(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB, which no {kind.name} is; {kind.give}")
    return data
