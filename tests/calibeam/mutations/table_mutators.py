"""Changes to a table of samples: columns, rows, cells, numerals; as CSV, and the same and other types as Parquet."""

import csv
import io
import math
import re
import zipfile
from collections.abc import Callable
from typing import Any

import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE

from tests.calibeam.mutations.text_mutators import (
    NUMBERS,
    TEXT,
    TEXTS,
    Mutator,
    Rng,
    bad_utf8,
    blank,
    bom,
    crlf,
    cut,
    flipped,
    lengths,
    long_line,
    many,
    nul,
    pick,
)


def _table(change: Callable[[Rng, list[list[str]]], list[list[str]]]) -> Mutator:
    """A mutator of a CSV file from one of its rows, header first."""

    def made(rng: Rng, data: bytes) -> bytes:
        rows = change(rng, list(csv.reader(io.StringIO(data.decode()))))
        out = io.StringIO()
        csv.writer(out, lineterminator="\n").writerows(rows)
        return out.getvalue().encode()

    made.__name__ = change.__name__
    return made


def _column(rng: Rng, rows: list[list[str]]) -> int:
    return int(rng.integers(len(rows[0])))


@_table
def column_lost(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    at = _column(rng, rows)
    return [row[:at] + row[at + 1 :] for row in rows]


@_table
def column_added(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    name = pick(
        rng, ("extra", "", "q9_rad", "qd1_rad_s", "temp_Ω_degC", "x" * many(rng), "approach1", "repeat", "payload_kg")
    )
    values = pick(rng, (["1"], ["1e308"], ["0"], ["text"], [""], ["1", "2"], ["1e30", "-1e30"]))
    return [[*rows[0], name], *([*row, values[k % len(values)]] for k, row in enumerate(rows[1:]))]


@_table
def column_equal(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    at, value = _column(rng, rows), pick(rng, (*NUMBERS[:8], rows[1][0], "0.0", "1e-9"))
    return [rows[0], *([*row[:at], value, *row[at + 1 :]] for row in rows[1:])]


@_table
def joint_zero(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    joints = [k for k, name in enumerate(rows[0]) if re.fullmatch(r"q\d_rad", name)] or [0]
    chosen = joints if rng.random() < 0.3 else [pick(rng, joints)]
    return [rows[0], *(["0.0" if k in chosen else cell for k, cell in enumerate(row)] for row in rows[1:])]


@_table
def columns_huge(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    value, some = pick(rng, ("1e308", "-1e308", "1e30", "1e200", "1e-308")), rng.random(len(rows[0])) < 0.5
    return [rows[0], *([value if some[k] else cell for k, cell in enumerate(row)] for row in rows[1:])]


@_table
def columns_scaled(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    """Another unit, or a far frame."""
    at, factor = _column(rng, rows), pick(rng, (57.29577951308232, 1e3, 1e6, -1.0, 1e-12, 1e100))

    def scaled(cell: str) -> str:
        try:
            return repr(float(cell) * factor)
        except ValueError:
            return cell

    return [rows[0], *([*row[:at], scaled(row[at]), *row[at + 1 :]] for row in rows[1:])]


@_table
def cell(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    k, at = int(rng.integers(1, len(rows))), _column(rng, rows)
    rows[k][at] = pick(rng, (*NUMBERS, *TEXTS, "", "a" * many(rng)))
    return rows


@_table
def digits(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    """Numerals of other scripts in a column, or a decimal comma."""
    at = _column(rng, rows)
    other = pick(rng, ("٠١٢٣٤٥٦٧٨٩", "०१२३४५६७८९", "０１２３４５６７８９", ""))
    table = str.maketrans("0123456789", other) if other else str.maketrans(".", ",")
    return [rows[0], *([*row[:at], row[at].translate(table), *row[at + 1 :]] for row in rows[1:])]


@_table
def few_rows(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    return rows[: pick(rng, (1, 2, 3, 4, 6, 9, 12, 13))]


@_table
def rows_same(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    return [rows[0], *[rows[1]] * pick(rng, (2, 12, 20))]


@_table
def ragged(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    k = int(rng.integers(len(rows)))
    rows[k] = pick(rng, (rows[k][:-1], rows[k] * 2, [], rows[k][:1], [*rows[k], "1"]))
    return rows


@_table
def header_twice(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    at, other = _column(rng, rows), _column(rng, rows)
    rows[0][at] = rows[0][other] if at != other else rows[0][at].upper()
    return rows


@_table
def holes(rng: Rng, rows: list[list[str]]) -> list[list[str]]:
    share = pick(rng, (0.05, 0.5))
    return [rows[0], *([pick(rng, ("", "nan")) if rng.random() < share else c for c in row] for row in rows[1:])]


def semicolons(rng: Rng, data: bytes) -> bytes:
    return data.replace(b",", pick(rng, (b";", b"\t", b" ", b",,")))


def quotes(rng: Rng, data: bytes) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + b'"' + data[at:]


def parquet_table(rng: Rng, data: bytes) -> bytes:
    table = pq.read_table(io.BytesIO(data))
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(table.column_names)
    writer.writerows(zip(*(column.to_pylist() for column in table.columns), strict=True))
    rows = list(csv.reader(io.StringIO(pick(rng, TABLE_ONLY)(rng, out.getvalue().encode()).decode())))
    names = [name or f"c{k}" for k, name in enumerate(rows[0])]
    columns = [[_number(row[k]) if k < len(row) else None for row in rows[1:]] for k in range(len(names))]
    made = io.BytesIO()
    pq.write_table(pa.Table.from_arrays([_array(each) for each in columns], names=names), made)
    return made.getvalue()


def workbook_table(rng: Rng, data: bytes) -> bytes:
    """The sheet as a table, changed; a cell that is a number stays one."""
    sheet = openpyxl.load_workbook(io.BytesIO(data)).worksheets[0]
    out = io.StringIO()
    csv.writer(out).writerows(sheet.iter_rows(values_only=True))
    book = openpyxl.Workbook()
    for row in csv.reader(io.StringIO(pick(rng, TABLE_ONLY)(rng, out.getvalue().encode()).decode())):
        book.worksheets[0].append([_cell(each) for each in row])
    made = io.BytesIO()
    book.save(made)
    return made.getvalue()


def _cell(text: str) -> float | str:
    """What a workbook can hold: no control characters, at most 32,767 characters."""
    number = _number(text)
    plain = ILLEGAL_CHARACTERS_RE.sub("", text)[:32_767]
    return plain if number is None or not math.isfinite(number) else number


def member_changed(rng: Rng, data: bytes) -> bytes:
    """One file of the archive, with its new checksum."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        chosen = pick(rng, [name for name in archive.namelist() if name.endswith((".xml", ".rels"))])
    return with_member(data, chosen, lambda text: pick(rng, TEXT)(rng, text))


def with_member(data: bytes, chosen: str, change: Callable[[bytes], bytes]) -> bytes:
    """The archive with that file changed."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, change(old.read(name)) if name == chosen else old.read(name))
    return made.getvalue()


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def _array(values: list[float | None]) -> Any:
    return pa.array(values, pa.float64())


def parquet_types(rng: Rng, data: bytes) -> bytes:
    table = pq.read_table(io.BytesIO(data))
    at, many = int(rng.integers(table.num_columns)), table.num_rows
    column = pick(
        rng,
        (
            pa.array(["text"] * many), pa.array([[1.0]] * many), pa.array([None] * many), pa.array([True] * many),
            pa.array([2**63 - 1] * many), pa.array([b"\xff"] * many), pa.array([{"a": 1}] * many),
            pa.array([0] * many, pa.timestamp("ns")), pa.array(["a"] * many).dictionary_encode(),
        ),
    )  # fmt: skip
    made = io.BytesIO()
    pq.write_table(table.set_column(at, table.column_names[at], column), made)
    return made.getvalue()


TABLE_ONLY: tuple[Mutator, ...] = (
    column_lost, column_added, column_equal, joint_zero, columns_huge, columns_scaled, cell, digits, few_rows,
    rows_same, ragged, header_twice, holes,
)  # fmt: skip
CSV = (flipped, cut, bad_utf8, nul, bom, crlf, long_line, semicolons, quotes, *TABLE_ONLY)
WORKBOOK = (flipped, cut, lengths, blank, *[workbook_table] * 4, *[member_changed] * 4)
PARQUET = (flipped, cut, lengths, blank, parquet_table, parquet_table, parquet_table, parquet_types)
