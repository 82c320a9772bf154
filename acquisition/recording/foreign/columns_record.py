"""How a foreign table was read: the file of columns beside what was made of it."""

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording.errors import RecordingError, shown
from acquisition.recording.examination import FOUND, ExaminationRecord, not_examined_lines
from acquisition.recording.files import write_json
from acquisition.recording.files.explain import suffix_of
from acquisition.recording.foreign.column_meanings import TEXT, TIME, UNUSED, Group
from acquisition.recording.foreign.conversion import Understanding, base_of, converted, times_of
from acquisition.recording.foreign.heading_units import si_symbol
from acquisition.recording.foreign.import_examinations import CONTENT, Imported, import_examinations, left_out
from acquisition.recording.foreign.sheet import NotTaken, Sheet
from acquisition.recording.recording import Recording
from acquisition.recording.samples import Samples
from acquisition.recording.session_folder import export


class ColumnRecord(msgspec.Struct, frozen=True):
    """One line of what was understood: headings, meaning, unit as read, columns that come of it, their range in SI."""

    headings: tuple[str, ...]
    meaning: str
    unit: str
    becomes: tuple[str, ...]
    si_unit: str  # of `becomes`, `lowest` and `highest`; "" where there is none or it is not known
    lowest: float | None
    highest: float | None


class ColumnsFile(msgspec.Struct, frozen=True):
    """Content of the file of columns beside a session folder: how a table was read."""

    schema: int
    kind: str
    software: str
    source: str
    source_sha256: str
    sheet: str
    rows: int
    columns: tuple[ColumnRecord, ...]
    unused: tuple[str, ...]
    notes: tuple[str, ...]
    stated: str  # as `--columns` takes it: reads the table again in the same way
    not_taken: tuple[NotTaken, ...] = ()  # columns, and topics of a bag with its first table
    examinations: tuple[ExaminationRecord, ...] = ()

    def not_taken_lines(self) -> Iterator[str]:
        """What nothing becomes of, for a person: columns, with the way to keep one; topics and their fields."""
        columns = [one for one in self.not_taken if one.kind == "column"]
        if columns:
            numbers = next((one.name for one in columns if one.type == "numbers" and one.name in self.unused), None)
            remedy = f" (keep one with --columns \"'{numbers}' = its_name\")" if numbers else ""
            yield f"not used: {'; '.join(one.says.removeprefix('column ') for one in columns)}{remedy}"
        others = [one.says for one in self.not_taken if one.kind != "column"]
        if others:
            yield f"not taken: {'; '.join(others)}"

    def examination_lines(self) -> Iterator[str]:
        """What the examinations have found beside what was not taken, and those that did not take place."""
        for one in self.examinations:
            if one.outcome == FOUND and one.what != CONTENT.what:
                yield f"{one.what}{f' ({one.where})' if one.where else ''}: {one.says}"
        yield from not_examined_lines(self.examinations)


def columns_file(
    table: Understanding, samples: Samples | None, software: str, others: Sequence[Understanding] = ()
) -> ColumnsFile:
    """What was understood, as it is printed and written; without `samples` it is a log, converted here.

    `others`: the tables before and behind it, of which the same import makes one recording.
    """
    sheet = table.sheet
    used = [group for group in table.groups if group.meaning != UNUSED]
    return ColumnsFile(
        1,
        "calibeam-columns",
        software,
        sheet.path.name,
        _sha256(sheet),
        sheet.name,
        len(sheet.rows),
        tuple(_record(table, group, samples) for group in used),
        table.unused(),
        tuple(_notes(table)),
        ", ".join(_clause(table, group) for group in used),
        left_out(table),
        import_examinations(Imported(table, tuple(others), is_log=samples is None)),
    )


def _sha256(sheet: Sheet) -> str:
    """Of the file, or of several one after the other; "" for a folder."""
    whole = hashlib.sha256()
    files = [file for file in dict.fromkeys(sheet.files) or (sheet.path,) if file.is_file()]
    for file in files:
        whole.update(file.read_bytes())
    return whole.hexdigest() if files else ""


def write_session(table: Understanding, samples: Samples, about: ColumnsFile, folder: Path) -> Path:
    """rig.toml and samples.csv into a new folder, and beside it the file of columns, whose path is returned.

    RecordingError where the folder is not empty, or the disk refuses.
    """
    recording = Recording(folder, table.rig_text, table.rig, samples, complete=True)
    export(recording, folder)
    return write_columns((about,), folder)


def write_columns(about: Sequence[ColumnsFile], out: Path) -> Path:
    """The file of columns beside what was made of one table, or a list of them; its path.

    RecordingError where the disk refuses.
    """
    columns_path = out.with_name(f"{out.name}.columns.json")
    content = about[0] if len(about) == 1 else about
    try:
        write_json(columns_path, content)
    except OSError as error:
        raise RecordingError(f"{columns_path}: cannot be written ({error.strerror}); choose another place") from error
    return columns_path


def _record(table: Understanding, group: Group, samples: Samples | None) -> ColumnRecord:
    targets = group.targets(table.rig.n_encoders)
    alike = [k for k, t in enumerate(targets) if t not in TEXT and suffix_of(t) == suffix_of(targets[0])]
    if samples is None:
        values = converted(table, group)[:, alike].ravel()
    else:
        values = np.concatenate([np.empty(0), *(samples.columns[targets[k]] for k in alike)])
    there = values[np.isfinite(values)]
    low, high = (float(there.min()), float(there.max())) if there.size else (None, None)
    return ColumnRecord(table.headings(group), group.meaning, group.unit, targets, si_symbol(group.suffix), low, high)


def _notes(table: Understanding) -> Iterator[str]:
    sheet = table.sheet
    time_group = next((group for group in table.groups if group.meaning == TIME), None)
    yield from sheet.notes
    if sheet.title:
        yield f"above the headings, not read: {shown('; '.join(sheet.title), 80)}"
    for number, file in enumerate(dict.fromkeys(sheet.files), start=1):
        count = sheet.files.count(file)
        name = file.absolute().relative_to(sheet.path).with_suffix("").as_posix()
        yield f"seat {number}: {name}, {count} row{'' if count == 1 else 's'}"
    if sheet.decimal == ",":
        yield "decimal comma"
    if time_group is None:
        yield "no column of time: rows are taken as one second apart, in the order of the table"
    elif base_of(times_of(sheet, time_group.columns[0]), time_group):
        yield "time counts from the first row"


def _clause(table: Understanding, group: Group) -> str:
    names = " ".join(f'"{n}"' if "'" in n else f"'{n}'" for n in table.headings(group))
    unit = f" [{group.unit}]" if group.suffix and group.unit else ""
    return f"{names}{unit} = {group.meaning}"
