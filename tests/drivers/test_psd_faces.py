"""From currents of a duo-lateral face to the spot and its doubt."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.psd_faces import FORMULAS, FaceKind, duo_lateral, mean_face, read_face

L_M = 0.02


def currents_a(x_m: float, y_m: float, photocurrent_a: float) -> np.ndarray:
    """The duo-lateral face the other way round: each layer divides the photocurrent like a lever."""
    right, top = 0.5 + x_m / L_M, 0.5 + y_m / L_M
    return photocurrent_a * np.array([1.0 - right, right, 1.0 - top, top])


def test_the_documented_example():
    spot = duo_lateral([90e-6, 110e-6, 100e-6, 100e-6], L_M)
    assert float(spot.x_m) == pytest.approx(1e-3)
    assert float(spot.y_m) == 0.0
    assert float(spot.sum_a) == pytest.approx(200e-6)


position = st.floats(-0.0099, 0.0099)


@given(position, position, st.floats(1e-7, 5e-4))
def test_the_spot_does_not_depend_on_brightness(x_m, y_m, photocurrent_a):
    spot = duo_lateral(currents_a(x_m, y_m, photocurrent_a), L_M)
    np.testing.assert_allclose([spot.x_m, spot.y_m], [x_m, y_m], atol=1e-15)
    assert float(spot.sum_a) == pytest.approx(photocurrent_a)


def test_shapes_are_kept_and_darkness_is_nan():
    both = np.zeros((5, 2, 4))
    both[:, 0] = currents_a(1e-3, -2e-3, 1e-4)
    spot = duo_lateral(both, L_M)
    assert spot.x_m.shape == (5, 2)
    assert np.isnan(spot.x_m[:, 1]).all()
    np.testing.assert_allclose(spot.y_m[:, 0], -2e-3)


def test_sigma_of_the_mean_is_the_scatter_of_means():
    """Electrode noise of 1 % on 400 means of 50 samples: stated and seen scatter agree, off the centre too."""
    rng = np.random.default_rng(5)
    noisy = currents_a(6e-3, -1e-3, 1e-4) + 1e-6 * rng.standard_normal((400, 50, 4))
    means = [mean_face(FaceKind.DUO_LATERAL, samples, L_M) for samples in noisy]
    seen_x, seen_y = np.std([m.x_m for m in means]), np.std([m.y_m for m in means])
    assert np.sqrt(np.mean([m.x_sigma_m**2 for m in means])) == pytest.approx(seen_x, rel=0.15)  # 4 sigma of 400 means
    assert np.sqrt(np.mean([m.y_sigma_m**2 for m in means])) == pytest.approx(seen_y, rel=0.15)
    assert np.mean([m.x_m for m in means]) == pytest.approx(6e-3, abs=5 * seen_x / 20)
    assert means[0].samples == 50


def test_flicker_of_the_laser_is_no_doubt_of_position():
    rng = np.random.default_rng(6)
    brightness = 1.0 + 0.2 * rng.standard_normal((100, 1))
    mean = mean_face(FaceKind.DUO_LATERAL, brightness * currents_a(6e-3, -1e-3, 1e-4), L_M)
    assert mean.x_m == pytest.approx(6e-3)
    assert mean.x_sigma_m < 1e-12


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="x1, x2, y1, y2"):
        duo_lateral(np.zeros((3, 8)), L_M)
    with pytest.raises(ValueError, match="sample >= 2"):
        mean_face(FaceKind.DUO_LATERAL, np.zeros((1, 4)), L_M)
    unknown = next(kind for kind in FaceKind if kind not in FORMULAS)
    with pytest.raises(ValueError, match=f"{unknown.name}: no formula"):
        read_face(unknown, np.zeros(4), L_M)
