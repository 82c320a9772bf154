"""From settled samples to observations: only rows with both spots, nothing guessed."""

import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.errors import DataError
from calibrate.model.observations import SIGMA_COLUMNS, observations

NAN = float("nan")
SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")


def samples(**changed):
    columns = {"t_s": [0.0, 1.0, 2.0], "q1_rad": [0.1, 0.2, 0.3], "q2_rad": [1.0, 1.1, 1.2]}
    columns |= {name: [1e-3, 2e-3, 3e-3] for name in SPOTS}
    columns |= {"placement": [1.0, 2.0, 2.0], "first_psd": [1.0, 2.0, 1.0]} | changed
    return Samples({k: np.array(v) for k, v in columns.items() if v is not None}, 2)


def test_rows_become_observations():
    data = observations(samples())
    np.testing.assert_array_equal(data.q_rad, [[0.1, 1.0], [0.2, 1.1], [0.3, 1.2]])
    assert data.placement.tolist() == [1, 2, 2]
    assert data.first_psd.tolist() == [1, 2, 1]
    assert (data.sigma_m, data.repeat) == (None, None)


def test_rows_without_both_spots_are_left_out():
    data = observations(samples(psd2_y_m=[1e-3, NAN, 3e-3]))
    assert data.placement.tolist() == [1, 2]


def test_stated_sigmas_and_repeats_are_taken():
    sigmas = {name: [1e-7, 2e-7, 3e-7] for name in SIGMA_COLUMNS}
    data = observations(samples(**sigmas, repeat=[4.0, NAN, 4.0]))
    assert data.sigma_m[1].tolist() == [2e-7] * 4
    assert data.repeat.tolist() == [4, -1, 4]


def test_sigmas_that_are_not_all_positive_are_not_used():
    sigmas = {name: [1e-7, 0.0, 3e-7] for name in SIGMA_COLUMNS}
    assert observations(samples(**sigmas)).sigma_m is None


def test_the_second_encoders_can_be_fitted_instead():
    table = samples(enc1_rad=[7.0, 8.0, 9.0], enc2_rad=[7.5, 8.5, 9.5])
    assert observations(table, "encoders").q_rad[1].tolist() == [8.0, 8.5]


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (samples(psd1_x_m=None), "no dual-PSD recording"),
        (samples(psd1_x_m=[NAN] * 3), "none of 3 rows"),
        (samples(placement=None), "no column placement"),
        (samples(first_psd=[1.0, NAN, 2.0]), "row 2: spots but no first_psd"),
    ],
)
def test_what_is_missing_is_named(table, says):
    with pytest.raises(DataError, match=says):
        observations(table)


def test_encoders_that_are_not_there_are_named():
    with pytest.raises(DataError, match="no columns enc1_rad"):
        observations(samples(), "encoders")
