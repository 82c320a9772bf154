"""Faults that rows show without any instrument: angles beyond the range of the rig, copies, rows left without their
pair.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, SEAT, Kind, kind_of
from calibrate.model.checks.gross_error import Blunder, BlunderKind, rows_in_words

Floats = NDArray[np.float64]

SLACK_RAD = (
    0.1  # a zero may be 4.5 deg off (calibrate/model/arms/link_tolerance.py), and ranges are stated in round numbers
)
SHARE = 0.1  # of the rows: beyond, it is the stated range that is in question and the instruments decide


def rows_beyond_limits(samples: Samples, limits_rad: Floats) -> tuple[Blunder, ...]:
    """One gross error a row whose angles leave their range (joint, 2)."""
    q_rad = samples.joints()
    beyond = (q_rad < limits_rad[:, 0] - SLACK_RAD) | (q_rad > limits_rad[:, 1] + SLACK_RAD)
    rows = np.flatnonzero(beyond.any(axis=1))
    if len(rows) > SHARE * len(q_rad):
        return ()
    return tuple(_beyond(row, beyond[row], q_rad[row], limits_rad) for row in rows.tolist())


def _beyond(row: int, beyond: NDArray[np.bool_], q_rad: Floats, limits_rad: Floats) -> Blunder:
    joints = np.flatnonzero(beyond).tolist()
    values = ", ".join(f"{q_rad[j]:g} rad is not within {limits_rad[j, 0]:g} to {limits_rad[j, 1]:g}" for j in joints)
    columns = ", ".join(f"q{j + 1}_rad" for j in joints)
    return Blunder(BlunderKind.BEYOND_LIMITS, (row,), columns, values, "correct the cell, or the range in the rig")


READINGS = ("psd1_x_m", "x_m", "wire_m")  # columns of instruments whose noise never repeats to the last digit


def duplicated_rows(samples: Samples) -> tuple[Blunder, ...]:
    """One gross error per row that repeats an earlier one in every column; its `rows` are the copies only.

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
    return tuple(_copies(original, rows) for original, rows in copies.items())


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


def _copies(original: int, rows: list[int]) -> Blunder:
    what = f"a copy of {rows_in_words([original])}, equal in every column"
    return Blunder(BlunderKind.DUPLICATED_ROWS, tuple(rows), "every column", what, "remove the copies")


AGAIN = "take both again, or remove it too"


def left_alone(samples: Samples, blunders: Sequence[Blunder]) -> tuple[Blunder, ...]:
    """One gross error for every row that has lost its partner to these gross errors, or to one found here."""
    copies = {row for b in blunders if b.kind is BlunderKind.DUPLICATED_ROWS for row in b.rows}
    bad = {row for b in blunders for row in b.rows}
    out: list[Blunder] = []
    while found := [*_ends(samples, copies, bad), *_last_in_seat(samples, bad)]:
        bad |= {row for b in found for row in b.rows}
        out += found
    return tuple(out)


def _ends(samples: Samples, copies: set[int], bad: set[int]) -> Iterator[Blunder]:
    """Consecutive rows that have a bar form a pair (calibrate/model/sensors/bar.py); a copy is none of them."""
    with_bar = [row for row in np.flatnonzero(samples.integers(BAR, -1) >= 0).tolist() if row not in copies]
    for pair in zip(with_bar[::2], with_bar[1::2], strict=False):
        gone = bad.intersection(pair)
        if len(gone) == 1:
            (left,) = set(pair) - gone
            (other,) = gone
            what = f"the other end of this bar, row {other + 1}, is left out"
            yield Blunder(BlunderKind.LEFT_ALONE, (left,), BAR_END, what, AGAIN)


def _last_in_seat(samples: Samples, bad: set[int]) -> Iterator[Blunder]:
    """A cone needs two rows to show anything (calibrate/model/sensors/seat.py)."""
    seat = samples.integers(SEAT, -1)
    for k in np.unique(seat[seat >= 0]).tolist():
        rows = set(np.flatnonzero(seat == k).tolist())
        if len(rows - bad) == 1 and len(rows) > 1:
            what = f"the only row of seat {k} when the others are left out"
            yield Blunder(BlunderKind.LEFT_ALONE, tuple(rows - bad), SEAT, what, AGAIN)
