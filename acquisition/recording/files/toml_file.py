"""Reads a TOML file into records, with one clear error that names file, line, key, value and remedy.

Rig files, pose plans, fit plans, error plans and tasks are all read here.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from acquisition.recording.errors import shown
from acquisition.recording.files.explain import explain
from acquisition.recording.rig_lines import KeyPath, key_lines, line_of

T = TypeVar("T")

LARGEST_BYTES = 4_000_000  # a plan of 20,000 poses; the largest rig files have 10,000 bytes
# tomllib keeps every beginning of a dotted key, which is without bound in memory: no file of ours has more than 6
_LONG_KEY = re.compile(r"""(?m)(?:^[ \t]*\[{0,2}|[{,])[ \t]*((?:[\w"'-]++[ \t]*\.[ \t]*){32})""")


@dataclass(frozen=True)
class TomlFile:
    """A valid TOML text; `name` stands for the file in errors, which are of type `fault`."""

    name: str
    document: dict[str, Any]
    lines: Mapping[KeyPath, int]
    fault: type[Exception]

    def checked(self, kind: type[T], document: Mapping[str, Any] | None = None) -> T:
        """The records of the file, or of `document`, its converted content. `fault` where it does not fit."""
        content = self.document if document is None else document
        try:
            return msgspec.convert(content, type=kind)
        except msgspec.ValidationError as error:
            raise self.error(*explain(error, content, kind)) from error

    def error(self, path: KeyPath, says: str) -> Exception:
        """An error at a key."""
        return self.fault(f"{self.name} line {line_of(self.lines, path)}: {says}")


def read_text(path: Path | str, what: str, fault: type[Exception]) -> str:
    """The text of a file to the letter, line ends included; `what` is its kind, for errors: "rig file"."""
    try:
        with Path(path).open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
        if len(data) > LARGEST_BYTES:
            raise fault(f"{path}: larger than {LARGEST_BYTES / 1e6:g} MB, which no {what} is; check the path")
        return data.decode("utf-8")
    except OSError as error:
        raise fault(f"{path}: cannot read the {what} ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise fault(f"{path} line {line}: byte {error.start} is not UTF-8; save the {what} as UTF-8") from error


def parse_toml(text: str, name: str, fault: type[Exception]) -> TomlFile:
    """The content of a TOML text, a byte order mark left out. `fault` with line and column for what is no TOML."""
    text = text.removeprefix("\ufeff")
    if long := _LONG_KEY.search(text):
        line = text.count("\n", 0, long.start(1)) + 1
        raise fault(f"{name} line {line}: '{shown(long[1], 40)}' is a key of more than 32 names; correct the line")
    try:
        return TomlFile(name, tomllib.loads(text), key_lines(text), fault)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_fault(name, text, str(error), fault) from error
    except RecursionError:
        raise fault(f"{name}: tables or lists within each other, hundreds deep; correct the file") from None
    except ValueError as error:  # an integer of more digits than Python reads
        says = str(error).partition(";")[0]
        raise fault(f"{name}: not TOML: {shown(says)}; correct the number") from error


def _syntax_fault(name: str, text: str, says: str, fault: type[Exception]) -> Exception:
    """The words of tomllib; their place is "(at line 3, column 5)" or "(at end of document)"."""
    place = re.search(r"\(at line ([0-9]+), column ([0-9]+)\)", says)
    line = int(place[1]) if place else text.count("\n") + 1
    wrong = re.sub(r"\s*\(at [^)]*\)$", "", says)
    column = f", column {place[2]}" if place else ""
    return fault(f"{name} line {line}{column}: not TOML: {shown(wrong)}; correct the line")
