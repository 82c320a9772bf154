"""A Parquet file as a table: a column whose cells are lists of numbers becomes one column for each element.

The elements of `q [rad]` are q1 [rad], q2 [rad], ..., those of a position x, y, z. Lists of several
lengths, or of more than ELEMENTS, stay as they are, and are named among what was not taken.
"""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any, cast

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.table_file import check_cells, parquet_table
from acquisition.recording.foreign.heading_units import folded, split_heading
from acquisition.recording.foreign.sheet import Raw, Sheet

ELEMENTS = 64  # of a list that becomes columns, at most: more are a picture or a curve
AXES = ("x", "y", "z")
PLACES = ("pos", "position", "tracker", "smr")  # names of lists of three coordinates, folded
COORDINATES = ("xyz",)  # the same, whose elements need no name of their own

Column = tuple[str, str, Sequence[Raw]]  # heading, unit beside it, cells


def parquet_sheet(path: Path) -> Sheet:
    """The table of a Parquet file. SamplesError where it cannot be read, or has more columns than the bounds."""
    table = parquet_table(path, SamplesError)
    try:
        cells = [table[i].to_pylist() for i in range(table.num_columns)]
    except (ValueError, NotImplementedError) as error:  # pyarrow.ArrowInvalid is a ValueError
        raise SamplesError(f"{path}: cannot read the Parquet file ({shown(str(error))}); write it again") from error
    units = [(field.metadata or {}).get(b"unit", b"").decode(errors="replace") for field in table.schema]
    names = [str(name) for name in table.column_names]
    columns: list[Column] = []
    notes: list[str] = []
    for at, field in enumerate(table.schema):
        one = (names[at], units[at], cast("Sequence[Raw]", cells[at]))
        if "list" not in str(field.type):
            columns.append(one)
            continue
        parts, note = _elements(one, {folded(split_heading(name)[0]) for name in names})
        columns += parts
        notes.append(note)
    check_cells(str(path), len(columns), 0, SamplesError)
    rows = tuple(zip(*(column for _, _, column in columns), strict=True))
    headings, beside = tuple(name for name, _, _ in columns), tuple(unit for _, unit, _ in columns)
    return Sheet(path, "", headings, beside, rows, tuple(range(1, len(rows) + 1)), notes=tuple(notes))


def _elements(column: Column, names: Collection[str]) -> tuple[list[Column], str]:
    """A column for each element, or the column itself, and what was done with it. `names`: folded, of all columns."""
    heading, unit, cells = column
    lists = [cast("list[Any]", cell) for cell in cells if isinstance(cell, list)]
    lengths = sorted({len(one) for one in lists})
    title = f"column '{shown(heading, 60)}'"
    if not lengths:
        return [column], f"{title} holds no list"
    if len(lengths) > 1 or not 0 < lengths[0] <= ELEMENTS:
        sizes = f"{lengths[0]} to {lengths[-1]}" if len(lengths) > 1 else f"{lengths[0]}"
        return [column], f"{title} holds lists of {sizes} values, which do not become columns"
    if not all(_is_number(value) for one in lists for value in one):
        return [column], f"{title} holds lists of other things than numbers, which do not become columns"
    parts = _headings(heading, lengths[0], names)
    made: list[Column] = [
        (p, unit, [cell[k] if isinstance(cell, list) else None for cell in cells]) for k, p in enumerate(parts)
    ]
    return made, f"{title} holds lists of {len(parts)}: read as {shown(parts[0], 60)} … {shown(parts[-1], 60)}"


def _is_number(value: Any) -> bool:
    """Whether an element may stand in a column of numbers; None is a reading that is missing."""
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _headings(heading: str, count: int, names: Collection[str]) -> list[str]:
    """Of the elements: numbered from 1, or x, y, z; different from the names of the other columns."""
    name, unit = split_heading(heading)
    ends = [str(k) for k in range(1, count + 1)]
    stem = f"{name}_" if name[-1:].isdigit() else name
    if count == len(AXES) and folded(name) in (*PLACES, *COORDINATES):
        ends = list(AXES)
        stem = "" if folded(name) in COORDINATES else f"{name}_"
    if any(folded(stem + end) in names for end in ends):
        stem = f"{name} element "
    return [f"{stem}{end}{f' [{unit}]' if unit else ''}" for end in ends]
