"""A row that says nothing without another is left out by name once the other is; all others stay."""

import numpy as np

from acquisition.recording import Samples
from calibrate.fit.gross_errors.bad_rows import left_alone
from calibrate.model.checks.gross_error import GrossError, GrossErrorKind


def samples(n, **columns):
    return Samples({"t_s": np.arange(n, dtype=float), "q1_rad": np.zeros(n), **columns}, 1)


def bad(*rows, kind=GrossErrorKind.BAD_SHOT):
    return GrossError(kind, rows, "x_m", "far away", "remove it")


def bars(ends, first, n=20):
    bar, end = np.full(n, np.nan), np.full(n, "")
    bar[first : first + len(ends)], end[first : first + len(ends)] = 1.0, list(ends)
    return samples(n, bar=bar, bar_end=end)


def test_the_other_end_of_a_bar_goes_along():
    (found,) = left_alone(bars("abbaab", 11), [bad(12)])
    assert (found.kind, found.rows) == (GrossErrorKind.LEFT_ALONE, (11,))
    assert found.says.startswith("row 12, bar_end: the other end of this bar, row 13, is left out")


def test_both_ends_named_leave_nobody_alone():
    assert left_alone(bars("abbaab", 11), [bad(11, 12)]) == ()


def test_a_copied_end_does_not_shift_the_pairs_behind_it():
    copied = bars("abbab", 10)  # row 12 repeats row 11
    assert left_alone(copied, [bad(12, kind=GrossErrorKind.DUPLICATED_ROWS)]) == ()
    (found,) = left_alone(copied, [bad(12, kind=GrossErrorKind.DUPLICATED_ROWS), bad(13)])
    assert found.rows == (14,)


def test_the_last_row_of_a_cone_goes_along_and_two_stay():
    seats = samples(8, seat=np.array([1, 1, 2, 2, 2, np.nan, 3, 3], dtype=float))
    (found,) = left_alone(seats, [bad(0), bad(3)])
    assert (found.kind, found.rows, found.column) == (GrossErrorKind.LEFT_ALONE, (1,), "seat")


def test_an_end_that_was_in_a_cone_takes_the_other_row_of_the_cone_with_it():
    bar, end, seat = np.full(5, np.nan), np.full(5, ""), np.full(5, np.nan)
    bar[:2], end[:2], seat[1:3] = 1.0, list("ab"), 4.0
    found = left_alone(samples(5, bar=bar, bar_end=end, seat=seat), [bad(0)])
    assert [b.rows for b in found] == [(1,), (2,)]


def test_a_cone_that_had_one_row_from_the_start_is_not_a_matter_of_gross_errors():
    assert left_alone(samples(3, seat=np.array([1.0, np.nan, np.nan])), [bad(2)]) == ()
