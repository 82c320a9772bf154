"""A foreign table as it stands in its file: headings, cells, and the place of each; nothing is converted."""

import math
import re
from dataclasses import dataclass
from datetime import date, datetime, time
from functools import cached_property
from pathlib import Path
from typing import Literal

import msgspec

from acquisition.recording.errors import SamplesError, shown

NAMED_AT_MOST = 12  # headings in an error
NUMBER = re.compile(r"[+-]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][+-]?\d+)?", re.ASCII)
COMMA_NUMBER = re.compile(r"[+-]?(?:\d+,\d*|,\d+)(?:[eE][+-]?\d+)?", re.ASCII)
NAMED = re.compile(r"[A-Za-z][A-Za-z #_.-]*(\d{1,6})", re.ASCII)  # such as R2
ERRORS = re.compile(r"#[A-Z/0!?]+")  # of a spreadsheet: #REF!, #DIV/0!, #N/A
NOT_THERE = ("", "nan", "na", "n/a", "null", "none", "-", "--")  # texts for a reading that is missing

Raw = float | int | str | datetime | date | time | bool | None


class NotTaken(msgspec.Struct, frozen=True):
    """A part of a file that nothing becomes of: its name, its type, and how many rows or messages hold it."""

    kind: Literal["column", "topic", "field"]
    name: str
    type: str
    count: int

    @property
    def says(self) -> str:
        """For a person."""
        name, unit = shown(self.name, 60), "row" if self.kind == "column" else "message"
        return f"{self.kind} {name} ({shown(self.type, 60)}), {self.count} {unit}{'' if self.count == 1 else 's'}"


@dataclass(frozen=True, eq=False)
class Sheet:
    """Headings and cells as they stand; `lines`: the number of each row in the file, from 1."""

    path: Path
    name: str  # of the sheet in a workbook, "" elsewhere
    headings: tuple[str, ...]
    unit_row: tuple[str, ...]  # "" where none stands
    rows: tuple[tuple[Raw, ...], ...]
    lines: tuple[int, ...]
    title: tuple[str, ...] = ()  # what stands above the headings
    heading_line: int = 0  # in the file, from 1; 0: the file has names of columns apart from its rows
    decimal: str = "."  # or ",": of numbers that are text
    files: tuple[Path, ...] = ()  # of each row, where they come from several files
    notes: tuple[str, ...] = ()  # what the file states of its columns, for a person
    not_taken: tuple[NotTaken, ...] = ()  # what the file holds beside this table
    aliases: tuple[str, ...] = ()  # of each heading, another name that a statement may use
    joint_columns: tuple[int, ...] = ()  # whose headings are names of joints, and whose cells are their angles

    def place(self, row: int | None = None, column: int | None = None) -> str:
        """Where a cell is, for a person: file, sheet, row, column."""
        sheet = f" sheet '{shown(self.name, 40)}'" if self.name else ""
        line = "" if row is None else f" row {self.lines[row]}"
        heading = "" if column is None else f", column '{shown(self.headings[column], 40)}'"
        return f"{self.files[row] if self.files and row is not None else self.path}{sheet}{line}{heading}"

    @property
    def titles(self) -> str:
        """The headings that are there, for a person."""
        at = f"row {self.heading_line} has the headings" if self.heading_line else "the columns are"
        some = [f"'{shown(h, 24)}'" for h in self.headings if h]
        return f"{at} {', '.join(some[:NAMED_AT_MOST])}{' …' if len(some) > NAMED_AT_MOST else ''}"

    def cells(self, column: int) -> list[Raw]:
        """One column, from the first row on."""
        return [row[column] for row in self.rows]

    def numbers(self, column: int) -> list[float]:
        """One column as numbers, NaN where a cell is empty. SamplesError for any other cell."""
        return [self._number(row, column, cell) for row, cell in enumerate(self.cells(column))]

    def numbers_of_names(self, column: int) -> list[float]:
        """The same of a column that may hold names such as R2 or SMR 2: the number that each ends with."""
        out: list[float] = []
        for row, cell in enumerate(self.cells(column)):
            named = NAMED.fullmatch(cell) if isinstance(cell, str) else None
            try:
                out.append(self._number(row, column, cell) if named is None else float(named[1]))
            except SamplesError:
                raise SamplesError(
                    f"{self.place(row, column)}: '{shown(str(cell), 40)}' is no number of a target; write that of its "
                    f"[[target]] in the rig file, or --columns \"'{shown(self.headings[column], 40)}' = unused\""
                ) from None
        return out

    def _number(self, row: int, column: int, cell: Raw) -> float:
        if cell is None:
            return math.nan
        if isinstance(cell, int | float) and not isinstance(cell, bool):
            if math.isfinite(cell) or math.isnan(cell):
                return float(cell)
        elif isinstance(cell, str):
            if cell.casefold() in NOT_THERE:
                return math.nan
            form = NUMBER if self.decimal == "." else COMMA_NUMBER
            if form.fullmatch(cell) or NUMBER.fullmatch(cell):
                return float(cell.replace(",", "."))
        raise SamplesError(
            f"{self.place(row, column)}: '{shown(str(cell), 40)}' is not a number; {self._remedy(cell)}, or empty the "
            "cell if the reading is missing"
        )

    def _remedy(self, cell: Raw) -> str:
        text = str(cell)
        if ERRORS.fullmatch(text):
            return "correct the formula in the spreadsheet"
        if "." in text and "," in text:
            return "write it without a separator of thousands"
        return "correct the cell"

    @cached_property
    def numeric(self) -> tuple[bool, ...]:
        """Of each column: whether every cell that is not empty is a number, and one is there."""

        def number(cell: Raw) -> bool:
            return is_number(cell) or (isinstance(cell, str) and COMMA_NUMBER.fullmatch(cell) is not None)

        filled = [[c for c in self.cells(i) if c is not None and not is_missing(c)] for i in range(len(self.headings))]
        return tuple(bool(cells) and all(map(number, cells)) for cells in filled)


def is_number(cell: Raw) -> bool:
    """Whether a cell is a number, or a text that is one with a decimal point."""
    if isinstance(cell, str):
        return NUMBER.fullmatch(cell) is not None
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def is_missing(cell: Raw) -> bool:
    """Whether a cell is the mark of a missing reading: a text such as n/a, or NaN."""
    return (isinstance(cell, str) and cell.casefold() in NOT_THERE) or (isinstance(cell, float) and math.isnan(cell))
