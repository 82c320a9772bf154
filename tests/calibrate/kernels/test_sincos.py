"""Sine and cosine of the compiled loops against a longer number format."""

import numpy as np
import pytest

from calibrate.kernels import compiled


def both(angle):
    sine, cosine = np.empty_like(angle), np.empty_like(angle)
    compiled.sincos_all(angle, sine, cosine)
    return sine, cosine


@pytest.mark.parametrize("reach", [1e-3, 0.8, 4.0, 100.0, 1e4, 1e8])
def test_sine_and_cosine_are_right_to_2e_16(reach):
    angle = np.random.default_rng(0).uniform(-reach, reach, 50_000)
    if np.finfo(np.longdouble).eps > 1e-18:
        pytest.skip("this machine has no number format longer than double")
    for found, exact in zip(both(angle), (np.sin, np.cos), strict=True):
        error = np.abs(found - exact(angle.astype(np.longdouble)))
        assert float(error.max()) <= 2e-16


def test_the_edges_of_the_quarter_turns_keep_their_signs():
    quarters = np.arange(-9, 10) * np.pi / 2
    angle = np.concatenate([quarters, np.nextafter(quarters, -10), np.nextafter(quarters, 10), quarters + np.pi / 4])
    sine, cosine = both(angle)
    np.testing.assert_allclose(sine, np.sin(angle), atol=2e-16)
    np.testing.assert_allclose(cosine, np.cos(angle), atol=2e-16)


def test_small_angles_keep_all_their_digits():
    angle = np.array([0.0, 1e-300, -1e-20, 1e-9])
    np.testing.assert_allclose(both(angle)[0], angle, rtol=1e-15)


def test_what_is_no_angle_gives_no_number():
    assert np.all(np.isnan(both(np.array([np.nan, np.inf, -np.inf, 1.1e8]))))
