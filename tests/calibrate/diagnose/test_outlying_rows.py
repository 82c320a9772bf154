"""Single outlying rows are blunders before physics; whatever lasts, or has all sizes, is left to physics."""

import numpy as np
import pytest

from calibrate.diagnose.outlying_rows import alone, unexplained_rows

NOWHERE = np.full(200, -1)


@pytest.fixture
def quiet():
    """Whitened misfits over three coordinates of 200 rows."""
    return np.linalg.norm(np.random.default_rng(3).normal(size=(200, 3)), axis=1)


def test_wrong_digits_here_and_there_are_found(quiet):
    quiet[[17, 90, 151]] = (400.0, 60.0, 9e4)
    np.testing.assert_array_equal(alone(quiet, 3, NOWHERE), [17, 90, 151])


def test_noise_alone_has_no_wild_row(quiet):
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_a_step_that_lasts_is_no_blunder(quiet):
    quiet[193:] += 500.0
    assert len(alone(quiet, 3, NOWHERE)) == 0


def test_a_moved_place_is_no_blunder_though_its_rows_are_scattered_over_the_session(quiet):
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


def test_rows_that_no_model_explains_are_told_unless_the_model_is_wrong():
    whitened = np.random.default_rng(1).normal(size=(200, 3))
    whitened[33] = 80.0
    np.testing.assert_array_equal(unexplained_rows(whitened), [33])
    whitened[::8] = 80.0
    assert len(unexplained_rows(whitened)) == 0
