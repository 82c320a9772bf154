"""Which rows form a length."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from calibrate.errors import DataError
from calibrate.model.sensors.bar import bar_pairs
from calibrate.model.sensors.distance import consecutive_pairs, shared_correlation

ROWS = np.array([2, 3, 5, 6])


def test_consecutive_ends_form_lengths_whichever_comes_first():
    pairs = bar_pairs(ROWS, np.array([1, 1, 2, 2]), np.array(["a", "b", "b", "a"]))
    assert_array_equal(pairs, [[2, 3], [6, 5]])


def test_an_end_without_its_partner_is_named():
    with pytest.raises(DataError, match="row 4, column 'bar_end': end a of bar 1 follows end a of bar 1"):
        bar_pairs(ROWS, np.array([1, 1, 2, 2]), np.array(["a", "a", "b", "a"]))
    with pytest.raises(DataError, match="row 6, column 'bar_end': end b of bar 2 follows end a of bar 1"):
        bar_pairs(ROWS[1:3], np.array([1, 2]), np.array(["a", "b"]))
    with pytest.raises(DataError, match="row 6, column 'bar_end': end b of bar 2 without the other end"):
        bar_pairs(ROWS[:3], np.array([1, 1, 2]), np.array(["a", "b", "b"]))


def test_neighbours_at_one_place_say_nothing_and_are_left_out():
    position = np.array([[0, 0, 0], [0, 0, 0.3], [0, 1e-4, 0.3], [0.4, 1e-4, 0.3]])
    pairs, length = consecutive_pairs(ROWS, position)
    assert_array_equal(pairs, [[2, 3], [5, 6]])
    np.testing.assert_allclose(length, [[0.3], [0.4]])
    with pytest.raises(DataError, match="4 positions, none"):
        consecutive_pairs(ROWS, np.zeros((4, 3)))


def test_noise_of_a_shared_position_joins_neighbouring_distances_only():
    corner = np.array([[0, 0, 0], [1.0, 0, 0], [3.0, 0, 0], [3.0, 1.0, 0], [3.0, 0, 0]])
    pairs = np.array([[0, 1], [1, 2], [2, 3], [3, 4]])
    np.testing.assert_allclose(shared_correlation(corner, pairs), [-0.5, 0.0, 0.5, 0.0], atol=1e-15)
    np.testing.assert_allclose(shared_correlation(corner, pairs[[0, 2, 3]]), [0.0, 0.5, 0.0], atol=1e-15)
