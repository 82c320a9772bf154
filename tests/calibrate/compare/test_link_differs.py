"""Differences judged by their own scatter, whatever was believed of the noise."""

import numpy as np
import pytest

from calibrate.compare.link_differs import chance_of_structure, scatter_of


@pytest.fixture
def noise():
    return np.random.default_rng(3).normal(0.0, 2e-6, (200, 2))


def test_white_noise_of_any_size_is_no_structure(noise):
    assert chance_of_structure(noise) > 0.01
    assert scatter_of(noise) == pytest.approx(np.full(2, 2e-6), rel=0.15)


@pytest.mark.parametrize(
    "more", [np.full(200, 1e-6), 3e-6 * np.sin(np.arange(200) / 15.0)], ids=["constant", "slow wave"]
)
def test_what_is_smaller_than_noise_but_in_all_rows_is_structure(noise, more):
    assert chance_of_structure(noise + more[:, None]) < 1e-6


def test_the_same_difference_in_every_row_is_no_chance_and_none_at_all_is():
    assert chance_of_structure(np.full((40, 1), 1e-8)) == 0.0
    assert chance_of_structure(np.zeros((40, 1))) == 1.0


def test_false_alarms_come_as_often_as_they_may():
    rng = np.random.default_rng(7)
    alarms = sum(chance_of_structure(rng.normal(size=(60, 1))) < 0.05 for _ in range(400))
    assert alarms <= 30  # 20 are due; 2.3 of their sigmas more


def test_a_handful_of_rows_says_nothing(noise):
    assert chance_of_structure(noise[:8] + 1.0) == 1.0
