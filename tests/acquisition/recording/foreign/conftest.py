"""Tables as laboratories write them: one session in SI, and writers of every dialect."""

import csv
import io
from pathlib import Path

import numpy as np
import openpyxl
import pytest

ROOT = Path(__file__).parents[4]
RIG = ROOT / "docs" / "examples" / "lab" / "rig.toml"
JOINTS = 6


@pytest.fixture(scope="session")
def rig_source() -> str:
    return RIG.read_text(encoding="utf-8")


def session(rows: int = 12, seed: int = 1) -> dict[str, np.ndarray]:
    """q (row, 6) rad, position (row, 3) m, t (row,) s: what a laser tracker reads of an arm."""
    rng = np.random.default_rng(seed)
    return {
        "q": rng.uniform(-2.0, 2.0, (rows, JOINTS)),
        "position": np.array([2.0, 0.5, 0.3]) + rng.uniform(-0.8, 0.8, (rows, 3)),
        "t": np.cumsum(rng.uniform(2.0, 9.0, rows)),
    }


def write_csv(path, headings, rows, *, separator=",", decimal=".", bom=False, encoding="utf-8", title=(), units=None):
    """A table with numbers to the last bit, as a program of that country writes it."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, delimiter=separator, lineterminator="\r\n")
    for line in (*((one,) for one in title), headings, *([units] if units else [])):
        writer.writerow(line)
    for row in rows:
        writer.writerow(repr(float(v)).replace(".", decimal) if isinstance(v, float) else v for v in row)
    path.write_bytes((b"\xef\xbb\xbf" if bom else b"") + text.getvalue().encode(encoding))
    return path


def write_xlsx(path, headings, rows, *, sheet="Messung", title=(), units=None, others=()):
    book = openpyxl.Workbook()
    table = book.active
    table.title = sheet
    for line in (*((one,) for one in title), headings, *([units] if units else [])):
        table.append(line)
    for row in rows:
        table.append(row)
    for name in others:
        book.create_sheet(name).append(("only", "words"))
    book.save(path)
    return path
