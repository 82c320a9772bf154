"""The report of a gross error: which rows, which column, what is wrong, what to do about it."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


class BlunderKind(Enum):
    """Faults of a file, not of an arm; the value is the short name for a person."""

    DEGREES = "joint angles in degrees"
    JOINT_SIGN = "joint counted the other way round"
    JOINT_OFFSET = "joint zero off by a quarter turn or more"
    JOINT_COUPLING = "joint angle counted from another link"
    TABLE_CONVENTION = "table of the arm by another convention"
    ANOTHER_ARM = "no arm of this table"
    MIRRORED_AXIS = "mirrored axis"
    MILLIMETRES = "lengths in millimetres"
    INVERTED_ROTATION = "orientation the other way round"
    EXCHANGED_PSD = "detectors exchanged"
    BEYOND_LIMITS = "joint angle beyond its limits"
    DUPLICATED_ROWS = "duplicated rows"
    LEFT_ALONE = "row without its partner"
    OTHER_SESSION = "rows of another session"
    WRONG_VALUE = "wrong value"
    BAD_SHOT = "bad shot"


@dataclass(frozen=True)
class Blunder:
    """One named fault. `rows` count from 0; empty: the whole file is affected and there is nothing to fit."""

    kind: BlunderKind
    rows: tuple[int, ...]
    column: str
    what: str
    remedy: str

    @property
    def whole_file(self) -> bool:
        return not self.rows

    @property
    def says(self) -> str:
        """One sentence; rows are counted from 1 below the header, as in every message about samples."""
        where = "all rows" if self.whole_file else rows_in_words(self.rows)
        return f"{where}, {self.column}: {self.what}; {self.remedy}"


def rows_in_words(rows: Sequence[int]) -> str:
    """Rows from 0 for a person, who counts from 1.

    >>> rows_in_words([4, 5, 6, 9])
    'rows 5-7, 10'
    """
    runs = runs_of(rows)
    text = ", ".join(str(first + 1) if first == last else f"{first + 1}-{last + 1}" for first, last in runs)
    return f"row {text}" if len(rows) == 1 else f"rows {text}"


def runs_of(rows: Sequence[int]) -> list[tuple[int, int]]:
    """Unbroken runs (first, last) of sorted row numbers."""
    runs: list[tuple[int, int]] = []
    for row in rows:
        if runs and row == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], row)
        else:
            runs.append((row, row))
    return runs
