"""samples.csv: text to checked samples and back, without loss."""

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from acquisition.recording.errors import RecordingError, SamplesError, shown
from acquisition.recording.rig.schema import Rig
from acquisition.recording.sample_rules import checked_samples
from acquisition.recording.samples import Cell, Samples, cells_of


def read_csv(path: Path | str, rig: Rig) -> Samples:
    """The samples of a CSV file (UTF-8, header row, commas, empty = missing).

    SamplesError naming file, row, column, value and remedy.
    """
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise SamplesError(f"{path}: cannot read the samples ({error.strerror}); check the path") from error
    except UnicodeDecodeError as error:
        raise SamplesError(f"{path}: byte {error.start} is not UTF-8; save the file as UTF-8") from error
    return parse_csv(text, str(path), rig)


def parse_csv(text: str, name: str, rig: Rig) -> Samples:
    """The samples of a CSV text; `name` stands for the file in errors. SamplesError as for `read_csv`."""
    lines: list[int] = []
    columns: dict[str, list[Cell]] = {}
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        header = _header([cell.strip() for cell in next(reader, [])], name)
        columns = {column: [] for column in header}
        for cells in reader:
            if cells:  # a blank line, as at the end of many files, has no cells at all
                lines.append(reader.line_num)
                _append(columns, cells, f"{name} row {len(lines)} (line {reader.line_num})")
    except csv.Error as error:
        raise SamplesError(f"{name} line {reader.line_num}: not CSV: {error}; correct the line") from error

    def place(row: int | None) -> str:
        return name if row is None else f"{name} row {row + 1} (line {lines[row]})"

    return checked_samples(columns, rig, place)


def write_csv(samples: Samples, path: Path) -> None:
    """Every cell so that it reads back bit for bit: the shortest text of a float, nothing for a missing cell.

    RecordingError when the disk refuses.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(samples.names)
    columns = [[_text(cell) for cell in cells_of(name, values)] for name, values in samples.columns.items()]
    writer.writerows(zip(*columns, strict=True))
    try:
        path.write_text(text.getvalue(), encoding="utf-8", newline="")
    except OSError as error:
        raise RecordingError(f"{path}: cannot write the samples ({error.strerror}); choose another place") from error


def check_header(names: Iterable[str], file: str) -> None:
    """SamplesError for a column without a name or a name that stands twice."""
    seen: set[str] = set()
    for number, column in enumerate(names, start=1):
        if not column:
            raise SamplesError(f"{file}: column {number} has no name; name it or remove it")
        if column in seen:
            raise SamplesError(f"{file}: column '{shown(column)}' stands twice; rename or remove one")
        seen.add(column)


def _header(names: list[str], file: str) -> list[str]:
    if not names:
        raise SamplesError(f"{file}: the file is empty; it needs a header row with t_s, q1_rad, ...")
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise SamplesError(f"{file} line 1: columns are parted by something else than commas; save as comma-separated")
    check_header(names, file)
    return names


def _append(columns: dict[str, list[Cell]], cells: list[str], place: str) -> None:
    if len(cells) != len(columns):
        raise SamplesError(
            f"{place}: {len(cells)} cells under {len(columns)} columns; give every column a cell, and decimals a point"
        )
    for column, cell in zip(columns.values(), cells, strict=True):
        column.append(cell.strip() or None)


def _text(cell: Cell) -> str:
    return "" if cell is None else repr(cell) if isinstance(cell, float) else str(cell)
