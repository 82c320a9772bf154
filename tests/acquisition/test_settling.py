"""Settled means: two neighbouring windows agree within their noise."""

import numpy as np
import pytest

from acquisition.settling import SettleRule, settled_from

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
