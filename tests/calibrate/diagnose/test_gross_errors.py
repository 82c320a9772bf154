"""Faults of a file are named before physics is sought, and what physics did is not taken for a fault. Single outlying
rows are gross errors; whatever lasts, or has all sizes, is left to physics.
"""

import numpy as np
import pytest

from calibrate.diagnose.gross_errors import alone, gross_errors_first, unexplained_rows
from calibrate.errors import DataError
from calibrate.model.checks.gross_error import GrossErrorKind
from tests.calibrate.diagnose.concealed import changed, recording_of


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    return recording_of(tmp_path_factory.mktemp("tracker"), family="tracker", seed=21, samples=120, arm="irb120")


def test_nothing_is_wrong_with_a_healthy_session(healthy):
    cleared = gross_errors_first(healthy.rig, healthy.samples)
    assert cleared.blunders == ()
    np.testing.assert_array_equal(cleared.rows, np.arange(120))


def test_a_wrong_digit_is_named_with_row_and_column(healthy):
    x = healthy.samples.column("x_m").copy()
    x[40] += 0.1
    (found,) = gross_errors_first(healthy.rig, changed(healthy.samples, x_m=x)).blunders
    assert (found.kind, found.rows, found.column) == (GrossErrorKind.WRONG_VALUE, (40,), "x_m")


def test_rows_left_out_are_counted_as_in_the_file(healthy):
    x = healthy.samples.column("x_m").copy()
    x[40] += 0.1
    twice = healthy.samples.take(np.sort(np.append(np.arange(120), 7)))
    (copy, wrong) = gross_errors_first(healthy.rig, changed(twice, x_m=np.insert(x, 8, x[7]))).blunders
    assert (copy.kind, copy.rows) == (GrossErrorKind.DUPLICATED_ROWS, (8,))
    assert wrong.rows == (41,)


@pytest.mark.parametrize("shift_m", [2e-4, 5e-3])
def test_a_device_that_was_bumped_is_physics(healthy, shift_m):
    y = healthy.samples.column("y_m").copy()
    y[80:] += shift_m
    assert gross_errors_first(healthy.rig, changed(healthy.samples, y_m=y)).blunders == ()


def test_a_session_joined_to_another_is_a_fault(healthy):
    y = healthy.samples.column("y_m").copy()
    y[90:] += 0.3
    found = gross_errors_first(healthy.rig, changed(healthy.samples, y_m=y)).blunders
    assert {b.kind for b in found} == {GrossErrorKind.OTHER_SESSION}
    assert {row for b in found for row in b.rows} == set(range(90, 120))


def test_a_joint_counted_the_other_way_round_makes_the_whole_file_wrong(healthy):
    turned = changed(healthy.samples, q3_rad=-healthy.samples.column("q3_rad"))
    cleared = gross_errors_first(healthy.rig, turned)
    assert cleared.whole_file
    assert cleared.blunders[0].kind is GrossErrorKind.JOINT_SIGN
    assert "q3" in cleared.blunders[0].column


def test_half_a_file_of_impossible_rows_is_refused(healthy):
    doubled = healthy.samples.take(np.repeat(np.arange(120), 2))
    with pytest.raises(DataError, match="of 240 rows"):
        gross_errors_first(healthy.rig, doubled)


NOWHERE = np.full(200, -1)


@pytest.fixture
def quiet():
    """Whitened misfits over three coordinates of 200 rows."""
    return np.linalg.norm(np.random.default_rng(3).normal(size=(200, 3)), axis=1)


def test_wrong_digits_here_and_there_are_found(quiet):
    quiet[[17, 90, 151]] = (400.0, 60.0, 9e4)
    np.testing.assert_array_equal(alone(quiet, 3, NOWHERE), [17, 90, 151])


def test_noise_alone_has_no_outlying_row(quiet):
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_a_step_that_lasts_is_no_gross_error(quiet):
    quiet[193:] += 500.0
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_a_moved_place_is_no_gross_error_though_its_rows_are_scattered_over_the_session(quiet):
    place = np.arange(200) % 25
    moved = (place == 4) & (np.arange(200) > 120)
    quiet[moved] += 500.0
    assert len(alone(quiet, 3, place)) == 0
    assert len(alone(quiet, 3, NOWHERE)) == moved.sum()  # without the place nobody can know


def test_physics_of_all_sizes_hides_no_gap(quiet):
    rows = np.arange(0, 200, 25)
    quiet[rows] += 12.0 * 1.9 ** np.arange(len(rows))
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_a_tenth_of_the_rows_is_no_accident(quiet):
    quiet[::10] += 1000.0
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_rows_that_no_model_explains_are_reported_unless_the_model_is_wrong():
    whitened = np.random.default_rng(1).normal(size=(200, 3))
    whitened[33] = 80.0
    np.testing.assert_array_equal(unexplained_rows(whitened), [33])
    whitened[::8] = 80.0
    assert len(unexplained_rows(whitened)) == 0
