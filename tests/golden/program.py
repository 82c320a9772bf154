"""The program from outside: its command line in this process, and the files that it writes.

Nothing else of the program is imported here, so that its inside can be rebuilt under these tests.
"""

import contextlib
import csv
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from calibeam.cli import run

Columns = dict[str, list[float | None]]
Json = dict[str, Any]


def run_program(*words: str | Path) -> str:
    """What the command prints. AssertionError where it does not end with exit code 0."""
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        code = run([str(word) for word in words])
    assert code == 0, f"calibeam {' '.join(map(str, words))}: exit code {code}\n{printed.getvalue()[-2000:]}"
    return printed.getvalue()


def identified(recording: Path, out: Path, *, plan: Path | None = None) -> Json:
    """The model that `calibeam identify` writes."""
    run_program("identify", recording, "--out", out, *(() if plan is None else ("--plan", plan)))
    return json.loads(out.read_text(encoding="utf-8"))


def diagnosed(recording: Path, out: Path) -> Json:
    """The diagnosis that `calibeam diagnose` writes."""
    run_program("diagnose", recording, "--out", out)
    return json.loads(out.read_text(encoding="utf-8"))


def predicted(model: Path, samples: Path, out: Path) -> Columns:
    """The predictions that `calibeam predict` writes."""
    run_program("predict", model, samples, "--out", out)
    return columns(out)


def columns(table: Path) -> Columns:
    """Of a CSV file of numbers, `None` where a cell is empty; ends `a` and `b` of a bar are 0 and 1."""
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [_number(row[name]) for row in rows] for name in rows[0]}


def _number(cell: str) -> float | None:
    return None if cell == "" else float({"a": 0, "b": 1}.get(cell, cell))


def write_session(folder: Path, rig: Path, lines: Iterable[str]) -> Path:
    """A session folder of a rig file and the lines of samples.csv, the header first."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rig.toml").write_bytes(rig.read_bytes())
    (folder / "samples.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder
