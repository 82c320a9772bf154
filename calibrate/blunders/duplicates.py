"""Rows that stand in the file more than once, digit by digit: a copy is no measurement."""

import numpy as np

from acquisition.recording import Samples
from acquisition.recording.samples import Kind, kind_of
from calibrate.blunders.finding import Blunder, BlunderKind, rows_in_words

READINGS = ("psd1_x_m", "x_m", "wire_m")  # columns of instruments whose noise never repeats to the last digit


def duplicated_rows(samples: Samples) -> tuple[Blunder, ...]:
    """One blunder per row that repeats an earlier one in every column; its `rows` are the copies only.

    The time may differ where an instrument's reading is in the row, since two shots never agree to the last digit;
    a seat row has no reading but the joints, whose counts can repeat, so there the time must be the same too.
    """
    keys = _keys(samples)
    first: dict[tuple[object, ...], int] = {}
    copies: dict[int, list[int]] = {}
    for row, key in enumerate(keys):
        original = first.setdefault(key, row)
        if original != row:
            copies.setdefault(original, []).append(row)
    return tuple(_blunder(original, rows) for original, rows in copies.items())


def _keys(samples: Samples) -> list[tuple[object, ...]]:
    numbers = [n for n in samples.names if kind_of(n) is not Kind.TEXT and n != "t_s"]
    values = np.stack([np.nan_to_num(samples.column(n), nan=-1e300) for n in numbers], axis=1)
    read = np.zeros(len(samples), dtype=bool)
    for name in READINGS:
        if name in samples:
            read |= np.isfinite(samples.column(name))
    ends = samples.columns.get("bar_end", np.full(len(samples), ""))
    times = samples.column("t_s")
    return [
        (row.tobytes(), str(end), None if seen else float(t))
        for row, end, seen, t in zip(values, ends, read, times, strict=True)
    ]


def _blunder(original: int, rows: list[int]) -> Blunder:
    what = f"a copy of {rows_in_words([original])}, equal in every column"
    return Blunder(BlunderKind.DUPLICATED_ROWS, tuple(rows), "every column", what, "remove the copies")
