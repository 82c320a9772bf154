"""poses.csv and touched points, read with the row and column of every fault, and the rows of corrected.csv
(docs/formats.md); besides the frame that is measured from touched points.

Frames of a program, bases and work objects, are measured again with the arm as it really is: one that was taught with
the uncorrected arm holds the error of that arm about its place, so corrected commands reach the frame as it is written,
not the part. It is measured from points of it that the real tool touches: the motion that brings them best onto where
the model has the tool. Source of its covariance: linear least squares.
"""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.files import shown
from acquisition.recording.files.bounds import most_of
from calibrate.apply.correct.corrected import OK, Arms, Corrected, Options, Wanted, as_samples
from calibrate.apply.correct.rotations import (
    FORMS,
    QUATERNION,
    VECTOR,
    RotationForm,
    pose,
)
from calibrate.apply.predicting import placed
from calibrate.errors import DataError
from calibrate.model.alignment import align
from calibrate.model.model_file import ModelFile
from calibrate.model.placement import point_by_twist

Floats = NDArray[np.float64]

LENGTHS = {"_m": 1.0, "_mm": 1e-3}
ANGLES = {"_rad": 1.0, "_deg": math.pi / 180.0}
UNIT = 1e-3  # of a quaternion's length: more digits than that are lost nowhere


def read_poses(text: str, name: str, n_joints: int, frame: Floats, every: Mapping[str, float]) -> Wanted:
    """Wanted poses of a CSV text; `name` stands for the file in errors.

    `frame` (4, 4): of the coordinates, in the base. `every`: conditions that hold for all rows, columns come first.
    DataError naming row, column, value and remedy.
    """
    table = _table(text, name)
    n = len(next(iter(table.values()))) if table else 0
    if n == 0:
        raise DataError(f"{name}: no rows; give one wanted pose a row")
    position_m = np.stack([_column(table, axis, LENGTHS, name) for axis in "xyz"], axis=1)
    form, angles = _orientation(table, name)
    if form is QUATERNION:
        lengths = np.linalg.norm(angles, axis=1)
        if (bad := np.flatnonzero(np.abs(lengths - 1.0) > UNIT)).size:
            raise DataError(f"{name} row {bad[0] + 1}: qw, qx, qy, qz have length {lengths[bad[0]]:.4f}, not 1")
    near_rad = np.full((n, n_joints), np.nan)
    used = {f"{a}{u}" for a in "xyz" for u in LENGTHS} | {f"{a}{u}" for a in form.names for u in (*ANGLES, "")}
    for j in range(n_joints):
        if f"q{j + 1}_rad" in table:
            near_rad[:, j] = table[f"q{j + 1}_rad"]
            used.add(f"q{j + 1}_rad")
    conditions = {c: np.full(n, v) for c, v in every.items()} | {c: v for c, v in table.items() if c not in used}
    return Wanted(
        frame @ pose(position_m, form.to_matrix(angles)),
        np.full((n, n_joints), np.nan),
        near_rad,
        conditions,
        source=name,
    )


def read_points(text: str, name: str, n_joints: int) -> tuple[Floats, Floats]:
    """(point, 3) in their frame and (point, joint) readings at which the tool touched them. DataError as above."""
    table = _table(text, name)
    joints = [f"q{j + 1}_rad" for j in range(n_joints)]
    missing = [c for c in joints if c not in table]
    if missing or not len(table[joints[0]]):
        lacking = ", ".join(missing) or "rows"
        raise DataError(f"{name}: {lacking} missing; a touched point has x_m, y_m, z_m and q1_rad ...")
    return (
        np.stack([_column(table, axis, LENGTHS, name) for axis in "xyz"], axis=1),
        np.stack([_column(table, f"q{j + 1}", {"_rad": 1.0}, name) for j in range(n_joints)], axis=1),
    )


def corrected_rows(found: Corrected, frame: Floats) -> tuple[list[str], list[list[str]]]:
    """Header and rows of corrected.csv; overshoot points stand before the pose that they belong to."""
    joints = [f"q{j + 1}_rad" for j in range(found.q_rad.shape[1])]
    place = ["x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"]
    each = (found.before, found.after)
    figures = [
        (f"{kind}_{when}_{unit}", getattr(predicted, f"{kind}_{unit}"))
        for when, predicted in zip(("before", "after"), each, strict=True)
        for unit in ("m", "rad")
        for kind in ("error", "s_error")
    ]
    header = ["pose", "kind", "status", *joints, *place, *(name for name, _ in figures), "says"]
    in_frame = np.linalg.inv(frame) @ found.T_base_tool
    rows: list[list[str]] = []
    for row, status in enumerate(found.status):
        number = str(row + 1)
        if found.via_rad is not None and np.isfinite(found.via_rad[row]).all():
            empty = [""] * (len(place) + len(figures) + 1)
            rows.append([number, "approach", OK, *_cells(found.via_rad[row]), *empty])
        T = in_frame[row]
        turn = VECTOR.from_matrix(T[None, :3, :3])[0] if np.isfinite(T).all() else np.full(3, np.nan)
        numbers = [*found.q_rad[row], *T[:3, 3], *turn, *(values[row] for _, values in figures)]
        rows.append([number, "pose", status, *_cells(numbers), found.says[row]])
    return header, rows


def _cells(values: Sequence[float] | Floats) -> list[str]:
    return ["" if math.isnan(v) else repr(float(v)) for v in values]


def _table(text: str, name: str) -> dict[str, Floats]:
    reader = csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), strict=True)
    try:
        header = [cell.strip() for cell in next(reader, [])]
        rows = [(reader.line_num, cells) for cells in reader if cells]
    except csv.Error as error:
        raise DataError(f"{name} line {reader.line_num}: not CSV: {error}; correct the line") from error
    twice = next((c for c in header if header.count(c) > 1), None)
    if twice is not None:
        raise DataError(f"{name}: column {shown(twice)} stands twice; keep one")
    table: dict[str, list[float]] = {c: [] for c in header}
    for number, (line, cells) in enumerate(rows, start=1):
        if len(cells) != len(header):
            raise DataError(f"{name} row {number} (line {line}): {len(cells)} cells where the header has {len(header)}")
        for column, cell in zip(header, cells, strict=True):
            value = _number(cell.strip(), where := f"{name} row {number} (line {line}), {shown(column)}")
            if abs(value) > most_of(column):
                raise DataError(f"{where}: {value:g} is beyond {most_of(column):g}; correct it, or leave it empty")
            table[column].append(value)
    return {c: np.array(values) for c, values in table.items()}


def _number(cell: str, where: str) -> float:
    if cell == "":
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.inf
    if not math.isfinite(value):
        raise DataError(f"{where}: {shown(cell)} is not a number; correct the cell, or leave it empty")
    return value


def _column(table: Mapping[str, Floats], stem: str, units: Mapping[str, float], name: str) -> Floats:
    """In SI units; DataError where it is missing, stands in two units, or has an empty cell."""
    given = [unit for unit in units if stem + unit in table]
    names = " or ".join(stem + unit for unit in units)
    if len(given) != 1:
        state = "missing" if not given else "given twice"
        raise DataError(f"{name}: column {names} is {state}; a wanted pose has x, y, z and an orientation")
    values = table[stem + given[0]]
    if np.isnan(values).any():
        raise DataError(f"{name} row {int(np.flatnonzero(np.isnan(values))[0]) + 1}: {stem + given[0]} is empty")
    return values * units[given[0]]


def _orientation(table: Mapping[str, Floats], name: str) -> tuple[RotationForm, Floats]:
    """The form whose columns stand there, and its values (pose, k)."""
    found: list[tuple[RotationForm, Mapping[str, float]]] = []
    for form in FORMS:
        units = {"": 1.0} if form is QUATERNION else ANGLES
        if any(form.names[0] + unit in table for unit in units):
            found.append((form, units))
    if len(found) != 1:
        forms = "; ".join(", ".join(form.names) for form in FORMS)
        raise DataError(
            f"{name}: an orientation in exactly one of these forms is needed: {forms} (angles with _rad or _deg in "
            f"their names); found {len(found)}"
        )
    ((form, units),) = found
    return form, np.stack([_column(table, c, units, name) for c in form.names], axis=1)


FEWEST = 3
LARGEST_M = 5e-3  # that a point touched by hand is off


@dataclass(frozen=True, eq=False)
class MeasuredFrame:
    """`T_base_frame` (4, 4); `sigma` (6,) sigma of its shift in m and turn in rad; `rms_m` that the points leave."""

    T_base_frame: Floats
    sigma: Floats
    rms_m: float


def measured_frame(
    model: ModelFile, in_frame_m: Floats, q_rad: Floats, conditions: dict[str, Floats], options: Options
) -> MeasuredFrame:
    """From points (point, 3) of the frame and the joint readings (point, joint) at which the tool touches them.

    DataError for fewer than three points, or points on a line.
    """
    if len(in_frame_m) < FEWEST:
        raise DataError(f"a frame needs {FEWEST} touched points that do not lie on a line; there are {len(in_frame_m)}")
    arms = Arms.of(model, options)
    at = placed(
        model, as_samples(q_rad, conditions), point_m=arms.real_tool[:3, 3] if options.tool is not None else None
    )
    found = align(at.tip_m, in_frame_m)
    off_m = np.linalg.norm(in_frame_m @ found.T_a_b[:3, :3].T + found.T_a_b[:3, 3] - at.tip_m, axis=1)
    if off_m.max() > LARGEST_M:
        raise DataError(
            f"the frame does not fit its points: point {int(np.argmax(off_m)) + 1} is {1e3 * off_m.max():.1f} mm off, "
            f"the median {1e3 * np.median(off_m):.1f} mm; touch the points again, or correct their coordinates"
        )
    J = point_by_twist(in_frame_m @ found.T_a_b[:3, :3].T).reshape(-1, 6)
    left = (len(in_frame_m) - 2) * 3
    variance = len(in_frame_m) * found.rms_m**2 / left
    if np.isfinite(at.tip_sigma_m).all():
        variance += float(np.mean(at.tip_sigma_m**2))
    covariance = variance * np.linalg.inv(J.T @ J)
    return MeasuredFrame(found.T_a_b, np.sqrt(np.diag(covariance)), found.rms_m)
