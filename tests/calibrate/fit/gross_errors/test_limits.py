"""Angles that the joint cannot have are named by row and column; sloppy limits make no row suspicious."""

import numpy as np

from acquisition.recording import Samples
from calibrate.fit.gross_errors.bad_rows import rows_beyond_limits
from calibrate.model.checks.gross_error import GrossErrorKind

LIMITS = np.array([[-2.0, 2.0], [-1.0, 3.0]])


def samples(q, **columns):
    return Samples({"t_s": np.arange(len(q), dtype=float), "q1_rad": q[:, 0], "q2_rad": q[:, 1], **columns}, 2)


def test_a_typed_digit_beyond_the_range_names_row_column_and_range():
    q = np.zeros((40, 2))
    q[7, 1] = 5.5
    (found,) = rows_beyond_limits(samples(q), LIMITS)
    assert (found.kind, found.rows, found.column) == (GrossErrorKind.BEYOND_LIMITS, (7,), "q2_rad")
    assert found.says.startswith("row 8, q2_rad: 5.5 rad is not within -1 to 3")


def test_a_range_stated_in_round_numbers_makes_nobody_suspicious():
    q = np.zeros((40, 2))
    q[3, 0] = 2.05
    assert rows_beyond_limits(samples(q), LIMITS) == ()


def test_where_many_rows_leave_the_range_it_is_the_range_that_is_wrong():
    q = np.zeros((40, 2))
    q[::5, 0] = 2.6
    assert rows_beyond_limits(samples(q), LIMITS) == ()
