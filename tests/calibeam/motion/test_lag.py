"""The lag of an arm behind its set-points, from what was sent and heard."""

import numpy as np
import pytest

from calibeam.motion.examples import lag_s


def curve(t_s: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(2.0 * t_s), 0.3 * np.cos(t_s), np.zeros_like(t_s)], axis=1)


@pytest.mark.parametrize("late_s", [0.0, 0.008, 0.03])
def test_it_is_found_to_a_tenth_of_a_millisecond(late_s: float) -> None:
    sent_s, heard_s = np.arange(0.0, 5.0, 0.002), np.arange(0.0013, 5.0, 0.002)
    heard_rad = curve(heard_s - late_s) + np.random.default_rng(1).normal(0.0, 2e-5, (len(heard_s), 3))
    assert lag_s(sent_s, curve(sent_s), heard_s, heard_rad) == pytest.approx(late_s, abs=1e-4)


def test_an_arm_that_stands_tells_none() -> None:
    still_s = np.arange(0.0, 1.0, 0.002)
    still = np.zeros((len(still_s), 3))
    assert np.isnan(lag_s(still_s, still, still_s, still))
