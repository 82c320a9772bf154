"""Currents of the detectors: the position they stand for, and honest noise on it."""

import numpy as np
import pytest

from simulators.world.optics import DARK, DARK_NOISE_A, SATURATION_A, Photodetectors, Spot, Spots, sample_a

HALF_M = 0.010


def positions_m(currents_a: np.ndarray) -> np.ndarray:
    """(sample, 4): x1, y1, x2, y2 from the duo-lateral formula."""
    first, second = currents_a[:, 0::2], currents_a[:, 1::2]
    return HALF_M * (second - first) / (first + second)


def sampled(spots: Spots, n: int, rate_hz: float = 1000.0, noise_m: float = 2e-6, power_w: float = 1e-3) -> np.ndarray:
    detectors = Photodetectors(HALF_M, power_w, noise_m)
    seen = np.broadcast_to(detectors.see(spots), (n, 2, 8))
    return sample_a(seen, rate_hz, np.random.default_rng(11))


LIT = Spots(Spot(0.003, -0.0085, 0.7), Spot(-0.006, 0.0, 0.21), 1)


def test_currents_stand_for_the_spot_and_share_the_light():
    currents_a = sampled(LIT, 1, noise_m=0.0)
    assert positions_m(currents_a)[0] == pytest.approx((0.003, -0.0085, -0.006, 0.0), abs=1e-15)
    x1, x2, y1, y2 = currents_a[0, :4]
    assert x1 + x2 == pytest.approx(y1 + y2)
    assert x1 + x2 == pytest.approx(0.4 * 0.7e-3)  # 0.4 A/W of 0.7 mW


@pytest.mark.parametrize("power_w", [1e-3, 1e-5])
def test_one_sample_at_1_khz_has_2_um_of_noise_anywhere_and_at_any_brightness(power_w):
    spread_m = positions_m(sampled(LIT, 20000, power_w=power_w)).std(axis=0)
    np.testing.assert_allclose(spread_m, 2e-6, rtol=4.0 / np.sqrt(2 * 20000))


@pytest.mark.parametrize("rate_hz", [250.0, 4000.0])
def test_noise_grows_with_the_root_of_the_rate(rate_hz):
    spread_m = positions_m(sampled(LIT, 20000, rate_hz)).std(axis=0)
    np.testing.assert_allclose(spread_m, 2e-6 * np.sqrt(rate_hz / 1000.0), rtol=4.0 / np.sqrt(2 * 20000))


def test_averaging_n_samples_falls_as_the_root_of_n():
    x_m = positions_m(sampled(LIT, 40000))[:, 0]
    for n in (4, 16, 100):
        means_m = x_m.reshape(-1, n).mean(axis=1)
        assert means_m.std() == pytest.approx(2e-6 / np.sqrt(n), rel=4.0 / np.sqrt(2 * len(means_m)))


def test_dark_faces_have_the_noise_of_their_amplifier_only():
    currents_a = sampled(DARK, 5000)
    assert currents_a.std() == pytest.approx(DARK_NOISE_A, rel=0.03)
    assert abs(currents_a.mean()) < 5 * DARK_NOISE_A / np.sqrt(currents_a.size)


def test_too_much_light_is_clipped():
    currents_a = sampled(LIT, 10, power_w=0.1)
    assert currents_a[:, 0].max() == SATURATION_A
    assert currents_a.max() <= SATURATION_A
