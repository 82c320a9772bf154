"""A D-H table as CSV to a rig file: one row a joint, the units in the header, the convention in its first cell.

    modified; a [mm]; alpha [deg]; d [mm]; theta [deg]; lower [deg]; upper [deg]
    1; 0; 0; 340; 0; -170; 170

`standard` or `modified` (Craig: a and alpha stand in front of the turn) is a statement of the table's author: the
numbers alone do not show it. With `;` between the cells a decimal comma is read, too. Lines with # are skipped.
"""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from acquisition.recording.files import read_text, shown
from acquisition.recording.rig import Joint, Pose
from calibeam.new_rig.drawn import ANY_TURN_RAD, rig_file_text
from calibrate.errors import DataError

CONVENTIONS = {"standard": "dh", "dh": "dh", "modified": "mdh", "mdh": "mdh", "craig": "mdh"}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0, "°": math.pi / 180.0}
COLUMNS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "a": ("a_m", LENGTHS),
    "alpha": ("alpha_rad", ANGLES),
    "d": ("d_m", LENGTHS),
    "theta": ("theta_offset_rad", ANGLES),
    "theta_offset": ("theta_offset_rad", ANGLES),
    "lower": ("lower_rad", ANGLES),
    "upper": ("upper_rad", ANGLES),
}
NEEDED = ("a_m", "alpha_rad", "d_m")
_HEADER = re.compile(r"\s*(?P<name>[A-Za-z_]+?)\s*(?:[\[(]\s*(?P<unit>[^\])]+?)\s*[\])]|_(?P<suffix>[a-zµ]+))\s*")


def dh_table_text(path: Path, name: str) -> str:
    """The rig file of a table. DataError naming file, row, column and remedy."""
    text = read_text(path, "D-H table", DataError).removeprefix("\ufeff")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise DataError(f"{path}: a header row and one row a joint are needed")
    separator = ";" if ";" in lines[0] else ","
    header, *rows = csv.reader(lines, delimiter=separator)
    convention = header[0].strip().lower()
    if convention not in CONVENTIONS:
        raise DataError(
            f"{path}: the header begins with {shown(header[0].strip())}; it begins with standard or modified (Craig), "
            "which the numbers alone do not show"
        )
    columns = _columns(path, header)
    joints = [_joint(path, number, row, columns, separator) for number, row in enumerate(rows, start=1)]
    unlimited = "lower_rad" not in (key for key, _ in columns)
    notes = [f"From {path.name} (D-H table, {convention})."]
    if unlimited:
        notes.append("No limits there: every joint is taken as one turn either way; write the real ones.")
    return rig_file_text(name, CONVENTIONS[convention], joints, Pose(), notes)


def _columns(path: Path, header: Sequence[str]) -> list[tuple[str, float]]:
    """Key of the rig file and factor to SI of every column behind the first."""
    out: list[tuple[str, float]] = []
    for cell in header[1:]:
        found = _HEADER.fullmatch(cell)
        name = found["name"].lower() if found else cell.strip().lower()
        if name not in COLUMNS:
            raise DataError(f"{path}: column {shown(cell.strip())} is not one of {', '.join(COLUMNS)}; rename it")
        key, units = COLUMNS[name]
        unit = (found["unit"] or found["suffix"]) if found else ""
        if unit not in units:
            example = f"'{name} [{'mm' if units is LENGTHS else 'deg'}]'"
            raise DataError(f"{path}: column {shown(cell.strip())} needs its unit, as in {example}")
        if any(key == other for other, _ in out):
            raise DataError(f"{path}: column {shown(cell.strip())} stands twice; keep one")
        out.append((key, units[unit]))
    there = {key for key, _ in out}
    missing = [key for key in NEEDED if key not in there]
    if missing:
        raise DataError(f"{path}: no column for {', '.join(missing)}; add a, alpha and d with their units")
    if ("lower_rad" in there) != ("upper_rad" in there):
        raise DataError(f"{path}: lower and upper stand together or not at all; add the other one")
    return out


def _joint(path: Path, number: int, row: Sequence[str], columns: Sequence[tuple[str, float]], separator: str) -> Joint:
    if len(row) != len(columns) + 1:
        raise DataError(f"{path}, row {number}: {len(row)} cells, the header has {len(columns) + 1}; correct the row")
    values = {"lower_rad": -ANY_TURN_RAD, "upper_rad": ANY_TURN_RAD, "theta_offset_rad": 0.0}
    for (key, factor), cell in zip(columns, row[1:], strict=True):
        word = cell.strip().replace(",", ".") if separator == ";" else cell.strip()
        try:
            value = float(word)
        except ValueError as error:
            raise DataError(f"{path}, row {number}: {shown(cell.strip())} is no number; correct it") from error
        if not math.isfinite(value):
            raise DataError(f"{path}, row {number}: {shown(cell.strip())} is not finite; correct it")
        values[key] = value * factor
    try:
        return msgspec.convert(values, Joint)
    except msgspec.ValidationError as error:
        raise DataError(f"{path}, row {number}: {shown(str(error))}; correct it") from error
