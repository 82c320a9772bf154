"""Reads a TOML file into records, with one clear error that names file, line, key, value and remedy.

Rig files, pose plans, fit plans, error plans and tasks are all read here. `tomllib` gives values without places; so a
scan of the text finds the line of every key. It runs behind `tomllib`, trusts its grammar (TOML 1.0,
https://toml.io/en/v1.0.0) and only keeps account of where each key and each array element begins.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from acquisition.recording.errors import shown
from acquisition.recording.files.explain import KeyPath, explain

_WORD = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'  # multi-line strings first: they begin like two short ones
    r"|'''(?:.|\n)*?'{3,5}"
    r'|"(?:[^"\\\n]++|\\.)*+"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|\n"
    r"|[\[\]{}=,.]"
    r"""|[^\s\[\]{}=,."'\#]+""",
    re.DOTALL,
)


def key_lines(text: str) -> Mapping[KeyPath, int]:
    """Line (from 1) of every table header, key and array element of a valid TOML text."""
    return _Scan(text).lines


def line_of(lines: Mapping[KeyPath, int], path: KeyPath) -> int:
    """The line of this key, or of the innermost table around it that was written; 1 when nothing was."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path, 1)


class _Scan:
    """One pass over the words; `lines` is what remains."""

    def __init__(self, text: str) -> None:
        self.lines: dict[KeyPath, int] = {}
        self._tables: dict[KeyPath, int] = {}  # array of tables -> how many so far
        self._words = list(_words(text))
        self._at = 0
        self._base: KeyPath = ()
        while self._at < len(self._words):
            self._statement()

    def _statement(self) -> None:
        word = self._words[self._at][0]
        if word == "\n":
            self._at += 1
        elif word == "[":
            self._header()
        else:
            self._pair(self._base)

    def _header(self) -> None:
        line = self._words[self._at][1]
        self._at += 1
        array = self._words[self._at][0] == "["
        self._at += array
        names = self._names("]")
        path: KeyPath = ()
        for name in names[:-1]:
            path = self._latest((*path, name))
        path = (*path, names[-1])
        if array:
            self._at += 1  # the second bracket
            self._tables[path] = self._tables.get(path, 0) + 1
            path = (*path, self._tables[path] - 1)
        self._base = path
        self._note(path, line)

    def _pair(self, base: KeyPath) -> None:
        line = self._words[self._at][1]
        path = (*base, *self._names("="))
        self._note(path, line)
        self._value(path)

    def _names(self, end: str) -> list[str]:
        """A dotted key; leaves the scan behind `end`."""
        names: list[str] = []
        while (word := self._words[self._at][0]) != end:
            if word != ".":
                names.append(_unquoted(word))
            self._at += 1
        self._at += 1
        return names

    def _value(self, path: KeyPath) -> None:
        word = self._words[self._at][0]
        if word == "[":
            self._elements(path)
        elif word == "{":
            self._at += 1
            while (word := self._words[self._at][0]) != "}":
                if word in ",\n":
                    self._at += 1
                else:
                    self._pair(path)
            self._at += 1
        else:
            while self._at < len(self._words) and self._words[self._at][0] not in (",", "]", "}", "\n"):
                self._at += 1  # a number such as 0.5 is three words

    def _elements(self, path: KeyPath) -> None:
        self._at += 1
        index = 0
        while (word := self._words[self._at][0]) != "]":
            if word in ",\n":
                self._at += 1
                continue
            self._note((*path, index), self._words[self._at][1])
            self._value((*path, index))
            index += 1
        self._at += 1

    def _latest(self, path: KeyPath) -> KeyPath:
        """In a header, the name of an array of tables means its newest element."""
        return (*path, self._tables[path] - 1) if path in self._tables else path

    def _note(self, path: KeyPath, line: int) -> None:
        for length in range(1, len(path) + 1):
            self.lines.setdefault(path[:length], line)


def _words(text: str) -> list[tuple[str, int]]:
    """Every word but comments, with its line."""
    found: list[tuple[str, int]] = []
    line, counted = 1, 0
    for match in _WORD.finditer(text):
        line += text.count("\n", counted, match.start())
        counted = match.start()
        if not match[0].startswith("#"):
            found.append((match[0], line))
    return found


def _unquoted(word: str) -> str:
    if word[0] == '"':
        return next(iter(tomllib.loads(f"{word} = 0")))
    return word.strip("'")


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
