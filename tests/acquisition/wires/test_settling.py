"""Settled means: two neighbouring windows agree within their noise."""

import numpy as np
import pytest

from acquisition.wires.bench import SettleRule, settled_from, stretch_to_average

RULE = SettleRule()
TIME_S = np.arange(400) * 1e-3


def noisy(mean_m: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(5)
    return mean_m[:, None] + rng.normal(0.0, 2e-6, (len(mean_m), 4))


def test_still_spots_are_settled_at_once() -> None:
    assert settled_from(TIME_S, noisy(np.zeros(400)), RULE) == pytest.approx(0.0)


def test_ringing_spots_are_settled_when_the_ringing_is_below_the_noise() -> None:
    ringing = 1e-4 * np.exp(-TIME_S / 0.03) * np.cos(2 * np.pi * 17.0 * TIME_S)
    start_s = settled_from(TIME_S, noisy(ringing), RULE)
    assert start_s is not None
    assert 1e-4 * np.exp(-start_s / 0.03) < 1e-5  # what is left of it


def test_drifting_spots_never_settle() -> None:
    assert settled_from(TIME_S, noisy(1e-3 * TIME_S), RULE) is None


def test_a_dark_window_does_not_agree_with_a_lit_one() -> None:
    spots = noisy(np.zeros(400))
    spots[:20] = np.nan
    assert settled_from(TIME_S, spots, RULE) == pytest.approx(0.02)


def test_dark_faces_settle_as_dark() -> None:
    assert settled_from(TIME_S, np.full((400, 4), np.nan), RULE) == pytest.approx(0.0)


def test_too_few_samples_decide_nothing() -> None:
    assert settled_from(TIME_S[:30], noisy(np.zeros(30)), RULE) is None


def test_the_average_begins_where_it_settled_and_waits_for_its_dwell() -> None:
    spots = noisy(np.where(TIME_S < 0.06, 1e-3 * TIME_S, 6e-5))
    assert stretch_to_average(TIME_S[:100], spots[:100], 0.2, RULE) is None
    stretch = stretch_to_average(TIME_S, spots, 0.2, RULE)
    assert stretch is not None
    assert stretch.settled
    assert stretch.from_s == pytest.approx(0.06)
    assert stretch.to_s - stretch.from_s == pytest.approx(0.2)


def test_what_never_settles_is_averaged_at_the_limit_and_marked() -> None:
    time_s = np.arange(1100) * 1e-3
    stretch = stretch_to_average(time_s, noisy(1e-3 * time_s), 0.05, RULE)
    assert stretch is not None
    assert not stretch.settled
    assert stretch.to_s == pytest.approx(time_s[-1])


def test_a_slow_box_gives_more_than_one_sample_to_a_short_dwell() -> None:
    time_s = np.arange(40) * 1e-2
    stretch = stretch_to_average(time_s, noisy(np.zeros(40)), 0.005, RULE)
    assert stretch is not None
    assert np.sum((time_s >= stretch.from_s) & (time_s <= stretch.to_s)) >= 2
