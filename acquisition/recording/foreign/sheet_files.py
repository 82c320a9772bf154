"""A table of another program as it stands in its file: xlsx, CSV of any dialect, or Parquet; nothing is converted yet.

The heading row is the one with the most texts and no number, just above the numbers; rows above it are a title. A row
of units may follow. Without headings (`header_row` 0) the columns are named 1, 2, ... Two rows that may be headings,
with numbers between them, are refused.
Decimals are a point or a comma, decided once for the whole file and refused where both occur.
"""

import csv
import importlib
import io
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from acquisition.recording.errors import SamplesError, shown
from acquisition.recording.files.bounds import UNPACKED_BYTES
from acquisition.recording.files.table_file import check_cells, table_bytes
from acquisition.recording.foreign.heading_units import folded, unit_of
from acquisition.recording.foreign.parquet_sheet import parquet_sheet
from acquisition.recording.foreign.sheet import COMMA_NUMBER, NUMBER, Raw, Sheet, is_missing, is_number
from acquisition.recording.samples import SEAT

SUFFIXES = (".xlsx", ".xlsm", ".csv", ".tsv", ".txt", ".parquet")
SEPARATORS = (";", "\t", ",")  # in this order: a table with decimal commas has them inside its cells
TITLE_ROWS = 50  # above the headings, at most
LONGEST_HEADING = 200  # letters
GRID_CELLS = 200_000_000  # with the empty ones: of 12,000 rows with something in the last column of a spreadsheet
SHEETS = 100
# Parts that are large in good workbooks: tables, texts, and what nobody reads unless a workbook names it as a sheet
LARGE = ("xl/worksheets/", "xl/sharedStrings", "xl/charts/", "xl/drawings/", "xl/calcChain", "xl/pivotCache/")
OTHER_PART_BYTES = 2_000_000  # of any other part


def read_sheet(path: Path, sheet: str | None = None, header_row: int | None = None) -> Sheet:
    """The table of a file; `sheet`: of a workbook with several, `header_row` the row of headings, from 1 (0: none).

    SamplesError naming file and place where it cannot be read or holds no table.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise SamplesError(f"{path}: no table that this program reads; save it as one of {', '.join(SUFFIXES)}")
    if suffix in (".xlsx", ".xlsm"):
        return _workbook(path, sheet, header_row)
    if sheet is not None:
        raise SamplesError(f"{path}: --sheet {shown(sheet, 40)}: only a workbook has sheets; leave it out")
    if suffix != ".parquet":
        return _text(path, header_row)
    if header_row is not None:
        raise SamplesError(f"{path}: --header-row {header_row}: Parquet names its columns itself; leave it out")
    return parquet_sheet(path)


def read_seats(sources: Sequence[Path], sheet: str | None = None, header_row: int | None = None) -> Sheet:
    """One table with a column `seat` of files that hold the postures in one seat each (a ball in a socket).

    Seats are numbered from 1 in the order of the files; a folder means all tables in it and below, by name.

    SamplesError naming the file that cannot be read, has other headings than the first, or names seats itself.
    """
    files = [file for source in sources for file in (_tables_in(source) if source.is_dir() else (source,))]
    if twice := next((file for file in files if files.count(file) > 1), None):
        raise SamplesError(f"{twice}: given twice; one file is one seat")
    if len(files) < 2:
        raise SamplesError(f"{sources[0]}: --seat-from file: 1 table; give one for each seat, or their folder")
    tables = [read_sheet(file, sheet, header_row) for file in files]
    first = tables[0]
    if named := next((heading for heading in first.headings if folded(heading) == SEAT), None):
        raise SamplesError(f"{first.path}: column '{named}' names the seats already; leave --seat-from out")
    for table in tables:
        for what in ("headings", "unit_row", "decimal"):
            own, others = getattr(table, what), getattr(first, what)
            if own != others and (table.rows or what == "headings"):
                differ = f"{shown(str(own), 60)}, those of {first.path} are {shown(str(others), 60)}"
                raise SamplesError(
                    f"{table.path}: its {what.replace('_', ' ')}: {differ}; name only the files of seats, all written "
                    "in one way"
                )
    return replace(
        first,
        path=_common(files),
        headings=(*first.headings, SEAT),
        unit_row=(*first.unit_row, ""),
        rows=tuple((*row, number) for number, table in enumerate(tables, start=1) for row in table.rows),
        lines=tuple(line for table in tables for line in table.lines),
        files=tuple(file for file, table in zip(files, tables, strict=True) for _ in table.rows),
    )


def _tables_in(folder: Path) -> Sequence[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES and path.is_file())


def _common(files: Sequence[Path]) -> Path:
    """The folder that all files are in or below."""
    whole = [file.absolute() for file in files]
    return next(folder for folder in whole[0].parents if all(file.is_relative_to(folder) for file in whole))


def _text(path: Path, header_row: int | None) -> Sheet:
    content = table_bytes(path, "table", SamplesError)
    if b"\0" in content[:4096] and not content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise SamplesError(f"{path}: not a text file; save the table as CSV or xlsx")
    text = _decoded(content, path)
    separator = _separator(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True)
    held = _Rows()
    try:
        for cells in reader:
            held.take(f"{path} line {reader.line_num}", reader.line_num, cells)
    except csv.Error as error:
        raise SamplesError(f"{path} line {reader.line_num}: not CSV: {error}; correct the line") from error
    return _tabled(path, "", held.rows, header_row)


class _Rows:
    """Rows of a table with something in them, as they come, without the empty cells at their ends.

    `rows` may be begun a second time; what was taken before still counts.
    """

    def __init__(self) -> None:
        self.rows: list[tuple[int, list[Raw]]] = []
        self._cells = self._seen = 0

    def take(self, place: str, line: int, row: Sequence[Raw]) -> None:
        """One row. SamplesError for more than the bounds: of cells, and of empty ones as a program pads them."""
        self._seen += len(row)
        check_cells(place, 0, self._seen, SamplesError, GRID_CELLS)
        if len(row) > TITLE_ROWS and row.count(None) == len(row):
            return
        cells = [c.strip() or None if isinstance(c, str) else c for c in row]
        while cells and cells[-1] is None:
            cells.pop()
        if cells:
            self._cells += len(cells)
            check_cells(place, len(cells), self._cells, SamplesError)
            self.rows.append((line, cells))


def _decoded(content: bytes, path: Path) -> str:
    """UTF-8 with or without a mark, UTF-16 with one; else the code page of Western Windows, which Excel writes."""
    try:
        return content.decode("utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        pass
    try:
        return content.decode("cp1252")
    except UnicodeDecodeError as error:
        raise SamplesError(f"{path}: byte {error.start} is of no known text; save the file as CSV UTF-8") from error


def _separator(text: str) -> str:
    """The first of `;`, tab and comma that parts the most filled of the first rows alike; a space where there is none.

    The recorder of Universal Robots' RTDE client writes spaces.
    """
    lines = [line for line in io.StringIO(text[:1_000_000]) if line.strip()][:200]
    counts = {mark: [line.count(mark) for line in lines] for mark in SEPARATORS}
    best = max(SEPARATORS, key=lambda mark: (sum(1 for n in counts[mark] if n), mark != ","))
    return best if any(counts[best]) else " "


def _workbook(path: Path, wanted: str | None, header_row: int | None) -> Sheet:
    books = _openpyxl(path)
    _check_parts(path)
    try:
        book = books.load_workbook(path, read_only=True, data_only=True)
    except OSError as error:
        raise SamplesError(f"{path}: cannot read the workbook ({error.strerror or error}); check the path") from error
    except Exception as error:  # of a damaged archive or its XML the library raises whatever it stumbles over
        raise SamplesError(f"{path}: no workbook ({shown(str(error), 80)}); save it again as xlsx") from error
    try:
        if (count := len(book.worksheets)) > SHEETS:
            raise SamplesError(f"{path}: {count} sheets; at most {SHEETS} are read, save the table alone, or as CSV")
        held = _Rows()
        sheets = {str(one.title): _sheet_rows(path, one, held) for one in book.worksheets}
    finally:
        book.close()
    if wanted is not None and wanted not in sheets:
        raise SamplesError(f"{path}: no sheet '{shown(wanted, 40)}'; there are {shown(', '.join(sheets))}")
    tables = {n: rows for n, rows in sheets.items() if (n == wanted if wanted else _heading_row(rows) is not None)}
    if len(tables) > 1:
        raise SamplesError(f"{path}: several sheets hold tables ({shown(', '.join(tables))}); name one with --sheet")
    if not tables:
        raise SamplesError(f"{path}: no table in the workbook: no row of headings with numbers below; add headings")
    ((name, rows),) = tables.items()
    return _without_formulas(_tabled(path, name, rows, header_row), books)


def _check_parts(path: Path) -> None:
    """SamplesError for a workbook whose parts, by the directory of the archive, are larger than one to be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            parts = [part for part in archive.infolist() if part.filename.endswith((".xml", ".rels"))]
    except (OSError, ValueError, zipfile.BadZipFile, NotImplementedError):
        return  # said by who opens it
    large = [part for part in parts if part.filename.startswith(LARGE)]
    for those, most in ((large, UNPACKED_BYTES // 2), ([p for p in parts if p not in large], OTHER_PART_BYTES)):
        for part in those:
            if part.file_size > most:
                raise SamplesError(
                    f"{path}: '{shown(part.filename, 60)}' has {part.file_size / 1e6:.0f} MB when unpacked, more than "
                    f"{most / 1e6:g} MB; save the table alone, or as CSV"
                )


def _sheet_rows(path: Path, sheet: Any, held: "_Rows") -> list[tuple[int, list[Raw]]]:
    held.rows, where = [], f"{path} sheet '{shown(sheet.title, 40)}'"
    sheet.reset_dimensions()  # as stated they may be far larger than the table
    try:
        for line, row in enumerate(sheet.iter_rows(values_only=True), start=1):
            held.take(f"{where} row {line}", line, row)
    except SamplesError:
        raise
    except Exception as error:  # as above: the sheet is read while its rows are asked for
        raise SamplesError(
            f"{path}: sheet '{shown(sheet.title, 40)}' is damaged ({shown(str(error), 80)}); save it again"
        ) from error
    return held.rows


def _without_formulas(sheet: Sheet, books: Any) -> Sheet:
    """The same; SamplesError where an empty cell is a formula whose result no program has stored."""
    if not any(cell is None for row in sheet.rows for cell in row):
        return sheet
    book = books.load_workbook(sheet.path, read_only=True, data_only=False)
    try:
        rows = book[sheet.name].iter_rows(max_col=len(sheet.headings), max_row=sheet.lines[-1], values_only=True)
        wanted = set(sheet.lines)
        written = {line: row for line, row in enumerate(rows, start=1) if line in wanted}
    finally:
        book.close()
    for row, (line, cells) in enumerate(zip(sheet.lines, sheet.rows, strict=True)):
        for column, cell in enumerate(cells):
            formula = written[line][column] if cell is None else None
            if isinstance(formula, str) and formula.startswith("="):
                raise SamplesError(
                    f"{sheet.place(row, column)}: the formula '{shown(formula, 40)}' has no stored result; open the "
                    "workbook in the spreadsheet program and save it"
                )
    return sheet


def _tabled(path: Path, name: str, rows: Sequence[tuple[int, Sequence[Raw]]], header_row: int | None) -> Sheet:
    """Headings, a row of units if there is one, and rows of as many cells; rows without any content are left out."""
    where = f"{path} sheet '{shown(name, 40)}'" if name else str(path)
    if header_row is None:
        at = _heading_row(rows)
    elif header_row == 0:
        at, rows = 0, ((0, [str(i) for i in range(1, 1 + max((len(c) for _, c in rows), default=0))]), *rows)
    elif (at := next((i for i, (line, _) in enumerate(rows) if line == header_row), None)) is None:
        raise SamplesError(f"{where}: --header-row {header_row}: nothing stands there; give the row of the headings")
    if at is None:
        raise SamplesError(
            f"{where}: no row of headings with numbers below; write the columns' names above the numbers, or state "
            "their row: --header-row, 0 where there is none"
        )
    if header_row is None:
        _refuse_two_headings(where, rows, at)
    wide = max(i for i, cell in enumerate(rows[at][1]) if cell is not None) + 1
    headings = tuple("" if cell is None else str(cell) for cell in _padded(rows[at][1], wide))
    if (longest := max(headings, key=len)) and len(longest) > LONGEST_HEADING:
        raise SamplesError(
            f"{where} row {rows[at][0]}: heading '{shown(longest, 40)}' has {len(longest)} letters; shorten it"
        )
    below = [(line, tuple(_padded(cells, wide)), cells[wide:]) for line, cells in rows[at + 1 :] if any(_filled(cells))]
    units = [""] * wide
    if below and _is_unit_row(below[0][1]):
        units = ["" if cell is None else str(cell).strip("[]()") for cell in below[0][1]]
        below = below[1:]
    for line, _, beyond in below:
        if any(_filled(beyond)):
            raise SamplesError(f"{where} row {line}: more cells than the {wide} headings; give every column a heading")
    table = tuple(cells for _, cells, _ in below)
    title = tuple(str(c) for _, cells in rows[:at] for c in cells if c is not None)
    lines = tuple(line for line, _, _ in below)
    return Sheet(path, name, headings, tuple(units), table, lines, title, rows[at][0], _decimal(where, lines, table))


def _heading_row(rows: Sequence[tuple[int, Sequence[Raw]]]) -> int | None:
    """Of rows that may be headings the one with the most texts: titles have few. Of several the first."""
    return max(_possible_headings(rows), key=lambda at: len(_texts(rows[at][1])), default=None)


def _possible_headings(rows: Sequence[tuple[int, Sequence[Raw]]]) -> Iterator[int]:
    """Rows of two texts and more, no number and nothing that is missing, with numbers in one of the two rows below."""
    for at, (_, cells) in enumerate(rows[:TITLE_ROWS]):
        if len(_texts(cells)) < 2 or any(map(is_missing, cells)) or _numbers(cells) or _is_unit_row(cells):
            continue
        if any(len(_numbers(below)) >= 2 for _, below in rows[at + 1 : at + 3]):
            yield at


def _refuse_two_headings(where: str, rows: Sequence[tuple[int, Sequence[Raw]]], at: int) -> None:
    """SamplesError where another row may be the headings of numbers that stand between it and row `at`."""
    for other in _possible_headings(rows):
        first, second = sorted((at, other))
        both = _texts(rows[first][1]) & _texts(rows[second][1])
        if any(len(_numbers(cells) & both) >= 2 for _, cells in rows[first + 1 : second]):
            raise SamplesError(
                f"{where}: row {rows[first][0]} and row {rows[second][0]} may both be the headings, with numbers "
                f"between them; save each table alone, or take the lower one alone: --header-row {rows[second][0]}"
            )


def _is_unit_row(cells: Sequence[Raw]) -> bool:
    """Whether a row below the headings holds texts alone, most of them units: no row of missing readings."""
    texts = [cell.strip("[]()") for cell in cells if isinstance(cell, str)]
    if len(texts) < sum(_filled(cells)) or _numbers(cells):
        return False
    return 2 * sum(1 for text in texts if unit_of(text)) > len(texts)


def _decimal(where: str, lines: Sequence[int], rows: Iterable[tuple[Raw, ...]]) -> str:
    """What parts whole numbers from fractions in cells of text. SamplesError where it is now a point, now a comma."""
    comma: tuple[int, str] | None = None
    point: tuple[int, str] | None = None
    for line, cells in zip(lines, rows, strict=True):
        for cell in cells:
            if not isinstance(cell, str):
                continue
            if COMMA_NUMBER.fullmatch(cell):
                comma = comma or (line, cell)
            elif "." in cell and NUMBER.fullmatch(cell):
                point = point or (line, cell)
    if comma is not None and point is not None:
        raise SamplesError(
            f"{where}: '{comma[1]}' in row {comma[0]} has a decimal comma, '{point[1]}' in row {point[0]} a decimal "
            "point; write all numbers in one way, without separators of thousands"
        )
    return "," if comma is not None else "."


def _padded(cells: Sequence[Raw], wide: int) -> Iterator[Raw]:
    yield from cells[:wide]
    yield from [None] * (wide - len(cells))


def _filled(cells: Sequence[Raw]) -> Iterator[bool]:
    return (cell is not None for cell in cells)


def _numbers(cells: Sequence[Raw]) -> set[int]:
    """The columns of numbers, with a decimal point or comma."""
    return {i for i, c in enumerate(cells) if is_number(c) or (isinstance(c, str) and COMMA_NUMBER.fullmatch(c))}


def _texts(cells: Sequence[Raw]) -> set[int]:
    return {i for i, cell in enumerate(cells) if isinstance(cell, str)}


def _openpyxl(path: Path) -> Any:
    try:
        return importlib.import_module("openpyxl")
    except ImportError as error:
        raise SamplesError(f"{path}: reading a workbook needs openpyxl; pip install openpyxl, or save CSV") from error
