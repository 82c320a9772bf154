"""What `import` examines of a table or a log, and how each examination ended: content, joint angles, readings, times.

A new examination is one function here and one line in IMPORT_EXAMINATIONS.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time

import numpy as np

from acquisition.recording.errors import shown
from acquisition.recording.examination import Examination, ExaminationRecord
from acquisition.recording.foreign.column_meanings import TIME, TOUCHED, UNUSED, Group
from acquisition.recording.foreign.conversion import Understanding, converted
from acquisition.recording.foreign.sheet import NotTaken, Raw, is_missing
from acquisition.recording.samples import Floats

Records = Iterator[ExaminationRecord]
FEWEST_ROWS = 2
ANGLES = ("q", "enc", "cmd")  # the first that a table has is examined
JOINT_READINGS = (*ANGLES, "qd", "tau", "motor_tau")  # that a diagnosis of streams reads
TYPES = (
    (bool, "truth values"),
    (str, "text"),
    (datetime | date | time, "times"),
    (int | float, "numbers"),
    (list, "lists"),
    (dict, "records"),
    (bytes, "bytes"),
)
CONTENT = Examination("content of the file", (), 'state what a column is: --columns "HEADING [unit] = meaning"')
JOINT_ANGLES = Examination(
    "joint angles", ANGLES, 'give rows of several postures, and state their columns: --columns "A1..A6 [deg] = q"'
)
MEASUREMENTS = Examination(
    "measurements",
    ("position", "wire", "psd1_x", "seat", "plane", "bar", "sphere", *JOINT_READINGS),
    'give rows with readings that change, and state their columns: --columns "X Y Z [mm] = position"',
)
TIMES = Examination(
    "times", (TIME,), 'give two rows or more, and state the column of their times: --columns "Time [ms] = time"'
)


@dataclass(frozen=True, eq=False)
class Imported:
    """A table with units that are settled, the other tables of the same import, and whether they are logs."""

    table: Understanding
    others: tuple[Understanding, ...] = ()
    is_log: bool = False

    @property
    def where(self) -> str:
        """Of a log: its file or topic."""
        return shown(self.table.sheet.name or self.table.sheet.path.name, 100) if self.is_log else ""

    def measured(self, group: Group) -> bool:
        """Whether a column is a reading: of an instrument, and in a log of the joints, too."""
        return group.measures or (self.is_log and group.meaning in JOINT_READINGS)

    def elsewhere(self, wanted: Callable[[Group], bool]) -> bool:
        """Whether another table of the import has such a column."""
        return any(wanted(group) for other in self.others for group in other.groups)


def left_out(table: Understanding) -> tuple[NotTaken, ...]:
    """The columns that nothing becomes of and that have a cell, and what the file holds beside the table."""
    sheet = table.sheet
    used = {column for group in table.groups if group.meaning != UNUSED for column in group.columns}
    columns: list[NotTaken] = []
    for column, heading in enumerate(sheet.headings):
        cells = [] if column in used else [c for c in sheet.cells(column) if c is not None and not is_missing(c)]
        if cells or (heading and column not in used):
            kind = "numbers" if sheet.numeric[column] else _type_of(cells)
            columns.append(NotTaken("column", heading or f"{column + 1} without a heading", kind, len(cells)))
    return (*columns, *sheet.not_taken)


def _type_of(cells: Sequence[Raw]) -> str:
    kinds = {next((name for kind, name in TYPES if isinstance(cell, kind)), type(cell).__name__) for cell in cells}
    return " and ".join(sorted(kinds)) or "empty"


def _content(imported: Imported) -> Records:
    left = left_out(imported.table)
    if left:
        says = "not taken: " + "; ".join(one.says for one in left)
        yield CONTENT.found(shown(says, 2000), imported.where)
    else:
        yield CONTENT.nothing(1.0, "column or topic that is not taken", imported.where)


def _angles(imported: Imported) -> Records:
    table = imported.table
    there = {group.meaning: group for group in table.groups}
    group = next((there[meaning] for meaning in ANGLES if meaning in there), None)
    if group is not None:
        yield _of_values(JOINT_ANGLES, converted(table, group), imported.where, "angle")
    elif not imported.elsewhere(lambda one: one.meaning in ANGLES):
        yield JOINT_ANGLES.not_examined(
            "no column is understood as joint angles", imported.where, expected=table.rig.n_encoders > 0
        )


def _measurements(imported: Imported) -> Records:
    table = imported.table
    groups = [group for group in table.groups if imported.measured(group)]
    for group in groups:
        where = ", ".join(filter(None, (imported.where, group.meaning)))
        changes = group.meaning not in TOUCHED  # which of several is touched may be one and the same
        yield _of_values(MEASUREMENTS, converted(table, group), where, "reading", changes=changes)
    if not groups and not imported.elsewhere(imported.measured):
        yield MEASUREMENTS.not_examined("no column is understood as a measurement", imported.where)


def _of_values(
    examination: Examination, values: Floats, where: str, what: str, *, changes: bool = True
) -> ExaminationRecord:
    """`values`: (row, element), NaN where missing. `changes`: values that are all the same show nothing."""
    missing = np.isnan(values)
    filled = values[~missing.all(axis=1)]
    if len(values) < FEWEST_ROWS:
        return examination.not_examined(f"only {len(values)} {_rows(len(values))}", where)
    if not len(filled):
        return examination.not_examined(f"not one valid {what} in {len(values)} rows", where)
    if len(filled) < FEWEST_ROWS:
        return examination.not_examined(f"only 1 of {len(values)} rows has a valid {what}", where)
    if changes and all(np.ptp(column[~np.isnan(column)]) == 0.0 for column in _not_empty(filled)):
        return examination.not_examined(f"no {what} ever changes", where)
    if missing.any():
        return examination.found(f"{int(missing.sum())} of {missing.size} {what}s are missing", where)
    return examination.nothing(1.0, f"missing {what}", where)


def _not_empty(values: Floats) -> Iterator[Floats]:
    return (column for column in values.T if not np.isnan(column).all())


def _rows(count: int) -> str:
    return "row" if count == 1 else "rows"


def _times(imported: Imported) -> Records:
    table, where = imported.table, imported.where
    group = next((group for group in table.groups if group.meaning == TIME), None)
    if group is None:
        yield TIMES.not_examined("no column is understood as the time of each row", where, expected=imported.is_log)
        return
    steps_s = np.diff(converted(table, group)[:, 0])
    if len(steps_s) + 1 < FEWEST_ROWS:
        yield TIMES.not_examined(f"only {len(table.sheet.rows)} {_rows(len(table.sheet.rows))}", where)
    elif not steps_s.any():
        yield TIMES.not_examined("all rows have one time", where)
    elif (back := np.flatnonzero(steps_s < 0.0)).size:
        line = table.sheet.lines[int(back[0]) + 1]
        count = f"{back.size} step{'' if back.size == 1 else 's'}"
        yield TIMES.found(f"{count} back in time, first at row {line}", where)
    elif (same := np.flatnonzero(steps_s == 0.0)).size:
        yield TIMES.found(f"{same.size} {_rows(same.size)} with the time of the row before", where)
    else:
        yield TIMES.nothing(1.0, "row out of order", where)


IMPORT_EXAMINATIONS: tuple[tuple[Examination, Callable[[Imported], Records]], ...] = (
    (CONTENT, _content),
    (JOINT_ANGLES, _angles),
    (MEASUREMENTS, _measurements),
    (TIMES, _times),
)


def import_examinations(imported: Imported) -> tuple[ExaminationRecord, ...]:
    """The endings of all examinations of one table, in the order of the tuple."""
    return tuple(record for _, examine in IMPORT_EXAMINATIONS for record in examine(imported))
