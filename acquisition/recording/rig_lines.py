"""On which line of a TOML text a key stands; the standard reader gives values without places.

The text must already have been read by `tomllib`, so this scan trusts its grammar (TOML 1.0, https://toml.io/en/v1.0.0)
and only keeps account of where each key and each array element begins.
"""

import re
import tomllib
from collections.abc import Mapping

KeyPath = tuple[str | int, ...]  # ("arm", "joint", 0, "a_m"): elements of arrays are counted from 0

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
