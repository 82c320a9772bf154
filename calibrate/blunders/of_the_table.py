"""Rows that say nothing once another is left out: the other end of a bar, the last row that a cone has left."""

from collections.abc import Iterator, Sequence

import numpy as np

from acquisition.recording import Samples
from acquisition.recording.samples import BAR, BAR_END, SEAT
from calibrate.blunders.finding import Blunder, BlunderKind

AGAIN = "take both again, or remove it too"


def left_alone(samples: Samples, blunders: Sequence[Blunder]) -> tuple[Blunder, ...]:
    """One blunder for every row that has lost its partner to these blunders, or to one found here."""
    copies = {row for b in blunders if b.kind is BlunderKind.DUPLICATED_ROWS for row in b.rows}
    bad = {row for b in blunders for row in b.rows}
    out: list[Blunder] = []
    while found := [*_ends(samples, copies, bad), *_last_in_seat(samples, bad)]:
        bad |= {row for b in found for row in b.rows}
        out += found
    return tuple(out)


def _ends(samples: Samples, copies: set[int], bad: set[int]) -> Iterator[Blunder]:
    """Consecutive rows that have a bar form a pair (calibrate/sensors/bar.py); a copy is none of them."""
    with_bar = [row for row in np.flatnonzero(samples.integers(BAR, -1) >= 0).tolist() if row not in copies]
    for pair in zip(with_bar[::2], with_bar[1::2], strict=False):
        gone = bad.intersection(pair)
        if len(gone) == 1:
            (left,) = set(pair) - gone
            (other,) = gone
            what = f"the other end of this bar, row {other + 1}, is left out"
            yield Blunder(BlunderKind.LEFT_ALONE, (left,), BAR_END, what, AGAIN)


def _last_in_seat(samples: Samples, bad: set[int]) -> Iterator[Blunder]:
    """A cone needs two rows to say anything (calibrate/sensors/seat.py)."""
    seat = samples.integers(SEAT, -1)
    for k in np.unique(seat[seat >= 0]).tolist():
        rows = set(np.flatnonzero(seat == k).tolist())
        if len(rows - bad) == 1 and len(rows) > 1:
            what = f"the only row of seat {k} when the others are left out"
            yield Blunder(BlunderKind.LEFT_ALONE, tuple(rows - bad), SEAT, what, AGAIN)
