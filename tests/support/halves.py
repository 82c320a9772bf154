"""A concealed session in two halves: one is diagnosed, the other nobody has seen. Through the commands alone."""

import csv
from pathlib import Path

import msgspec
import numpy as np

from calibeam.cli import run
from simulators.conceal.case import conceal
from simulators.conceal.case_files import columns, write_case
from simulators.conceal.wanted import Wanted

OBSERVED = {
    "dual-psd": ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m"),
    "tracker": ("x_m", "y_m", "z_m"),
    "wire": ("wire_m",),
    "cones": ("tip_x_m", "tip_y_m", "tip_z_m"),
}
NORMAL_95 = 1.959964


def written_halves(folder, **wanted):
    """Folder of the recording to diagnose and file of the unseen samples, rows drawn at random; the case.

    Moves are told in columns of their own: the row before may be in the other half.
    """
    case = conceal(Wanted(**wanted))
    write_case(case, folder)
    table = columns(case)
    joints = len(case.reading_rad[0])
    q = np.array([table[f"q{j + 1}_rad"] for j in range(joints)])
    moves = np.diff(q, axis=1, prepend=q[:, :1])
    table |= {f"last_move{j + 1}_rad": row.tolist() for j, row in enumerate(moves)}
    rows = len(table["t_s"])
    seen = np.zeros(rows, dtype=bool)
    seen[np.random.default_rng(case.wanted.seed).permutation(rows)[: rows // 2]] = True
    if "bar" in table:  # both ends of a length belong together: all stay where the scale is found
        seen |= np.array([bar is not None for bar in table["bar"]])
    recording = folder / "recording"
    _write(recording / "samples.csv", table, np.flatnonzero(seen))
    _write(folder / "unseen.csv", table, np.flatnonzero(~seen))
    return recording, folder / "unseen.csv", case, ~seen


def _write(path, table, rows):
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        for row in rows.tolist():
            writer.writerow(["" if column[row] is None else column[row] for column in table.values()])


def diagnosed_and_predicted(folder, recording, unseen):
    """model.json as a record, columns of predicted.csv."""
    model, out = folder / "model.json", folder / "predicted.csv"
    assert run(["diagnose", str(recording), "--out", str(folder / "diagnosis.json"), "--model-out", str(model)]) == 0
    assert run(["predict", str(model), str(unseen), "--out", str(out), "--same-session"]) == 0
    return msgspec.json.decode(model.read_bytes()), table_of(out)


def table_of(path):
    with Path(path).open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file))
    return {name: [row[i] for row in rows] for i, name in enumerate(header)}


def numbers(column):
    return np.array([float(cell) if cell else np.nan for cell in column])


def judged(model, table, family):
    """(row, k) residual and one sigma of prediction and noise together."""
    names = OBSERVED[family]
    residual = np.stack([numbers(table[f"r_{name}"]) for name in names], axis=1)
    sigma = np.stack([np.hypot(numbers(table[f"s_{name}"]), model["noise"][name]) for name in names], axis=1)
    return residual, sigma


def inside_95(residual, sigma):
    """Share of readings within their intervals."""
    known = np.isfinite(residual)
    return float(np.mean(np.abs(residual[known]) <= NORMAL_95 * sigma[known]))
