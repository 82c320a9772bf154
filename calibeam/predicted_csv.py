"""predicted.csv: one row per sample, the shortest text of every number, nothing where there is none."""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def write_predicted(path: Path, columns: Mapping[str, NDArray[np.float64]], outside: Sequence[str]) -> None:
    """Write columns (row,), NaN as an empty cell, and the drivers of each row that are beyond their recorded range.

    OSError where the folder cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*columns, "outside"])
        for *row, beyond in zip(*(values.tolist() for values in columns.values()), outside, strict=True):
            writer.writerow([*("" if math.isnan(value) else repr(value) for value in row), beyond])
