"""From currents of every kind of face to the spot and its doubt."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from drivers.psd_faces import KINDS, Face, FaceKind, layer_mismatch

L_M = 0.02
DUO = Face(FaceKind.DUO_LATERAL, L_M)
SPOT_RADIUS_M = 0.5e-3


def currents_a(x_m: float, y_m: float, photocurrent_a: float) -> np.ndarray:
    """The duo-lateral face the other way round: each layer divides the photocurrent like a lever."""
    right, top = 0.5 + x_m / L_M, 0.5 + y_m / L_M
    return photocurrent_a * np.array([1.0 - right, right, 1.0 - top, top])


def edges_a(x_m: float, y_m: float, photocurrent_a: float) -> np.ndarray:
    """Tetra-lateral: one layer, so that each pair of edges carries half."""
    return 0.5 * currents_a(x_m, y_m, photocurrent_a)


def corners_a(x_m: float, y_m: float, photocurrent_a: float) -> np.ndarray:
    """Pin-cushion: each corner takes the product of its two levers; A, B, C, D clockwise from (-x, +y)."""
    right, top = 0.5 + x_m / L_M, 0.5 + y_m / L_M
    left, bottom = 1.0 - right, 1.0 - top
    return photocurrent_a * np.array([left * top, right * top, right * bottom, left * bottom])


def quadrants_a(x_m: float, y_m: float, photocurrent_a: float) -> np.ndarray:
    """Light exp(-2 r^2 / w^2) integrated over each quadrant by quadrature: no error function here."""

    def beyond_zero(centre_m: float) -> float:
        def density(t_m: float) -> float:
            return np.exp(-2.0 * (t_m - centre_m) ** 2 / SPOT_RADIUS_M**2)

        far_m = 8.0 * SPOT_RADIUS_M
        below, above = (quad(density, *ends, limit=200)[0] for ends in ((-far_m, 0.0), (0.0, far_m)))
        return above / (above + below)

    right, top = beyond_zero(x_m), beyond_zero(y_m)
    left, bottom = 1.0 - right, 1.0 - top
    return photocurrent_a * np.array([left * top, right * top, right * bottom, left * bottom])


FACES = {
    FaceKind.DUO_LATERAL: (DUO, currents_a),
    FaceKind.TETRA_LATERAL: (Face(FaceKind.TETRA_LATERAL, L_M), edges_a),
    FaceKind.PIN_CUSHION: (Face(FaceKind.PIN_CUSHION, L_M), corners_a),
    FaceKind.QUADRANT: (Face(FaceKind.QUADRANT, L_M, SPOT_RADIUS_M), quadrants_a),
}


def test_every_kind_has_a_formula_and_a_test():
    assert set(KINDS) == set(FaceKind) == set(FACES)


def test_the_documented_example():
    spot = DUO.read([90e-6, 110e-6, 100e-6, 100e-6])
    assert float(spot.x_m) == pytest.approx(1e-3)
    assert float(spot.y_m) == 0.0
    assert float(spot.sum_a) == pytest.approx(200e-6)


position = st.floats(-0.0099, 0.0099)


@pytest.mark.parametrize("kind", [kind for kind in FaceKind if kind is not FaceKind.QUADRANT])
@given(position, position, st.floats(1e-7, 5e-4))
def test_the_spot_does_not_depend_on_brightness(kind, x_m, y_m, photocurrent_a):
    face, made_a = FACES[kind]
    spot = face.read(made_a(x_m, y_m, photocurrent_a))
    np.testing.assert_allclose([spot.x_m, spot.y_m], [x_m, y_m], atol=1e-14)
    assert float(spot.sum_a) == pytest.approx(photocurrent_a)


@pytest.mark.parametrize(("x_m", "y_m"), [(0.0, 0.0), (0.1e-3, -0.2e-3), (-0.7e-3, 0.6e-3)])
def test_a_quadrant_face_reads_a_gaussian_spot(x_m, y_m):
    face, made_a = FACES[FaceKind.QUADRANT]
    spot = face.read(made_a(x_m, y_m, 2e-5))
    np.testing.assert_allclose([spot.x_m, spot.y_m, spot.sum_a], [x_m, y_m, 2e-5], rtol=1e-6, atol=1e-12)


def test_a_quadrant_face_with_all_light_on_one_side_says_nothing_of_metres():
    spot = FACES[FaceKind.QUADRANT][0].read([0.0, 2e-5, 2e-5, 0.0])
    assert np.isnan(spot.x_m)
    assert float(spot.y_m) == 0.0


def test_shapes_are_kept_and_darkness_is_nan():
    both = np.zeros((5, 2, 4))
    both[:, 0] = currents_a(1e-3, -2e-3, 1e-4)
    spot = DUO.read(both)
    assert spot.x_m.shape == (5, 2)
    assert np.isnan(spot.x_m[:, 1]).all()
    np.testing.assert_allclose(spot.y_m[:, 0], -2e-3)


@pytest.mark.parametrize("kind", FaceKind)
def test_sigma_of_the_mean_is_the_scatter_of_means(kind):
    """Electrode noise of 1 % on 400 means of 50 samples: stated and seen scatter agree, off the centre too."""
    face, made_a = FACES[kind]
    at_m = (0.3e-3, -0.1e-3) if kind is FaceKind.QUADRANT else (6e-3, -1e-3)
    rng = np.random.default_rng(5)
    noisy = made_a(*at_m, 1e-4) + 1e-6 * rng.standard_normal((400, 50, 4))
    means = [face.mean(samples) for samples in noisy]
    seen_x, seen_y = np.std([m.x_m for m in means]), np.std([m.y_m for m in means])
    assert np.sqrt(np.mean([m.x_sigma_m**2 for m in means])) == pytest.approx(seen_x, rel=0.15)  # 4 sigma of 400 means
    assert np.sqrt(np.mean([m.y_sigma_m**2 for m in means])) == pytest.approx(seen_y, rel=0.15)
    assert np.mean([m.x_m for m in means]) == pytest.approx(at_m[0], abs=5 * seen_x / 20)
    assert means[0].samples == 50


def test_flicker_of_the_laser_is_no_uncertainty_of_position():
    rng = np.random.default_rng(6)
    brightness = 1.0 + 0.2 * rng.standard_normal((100, 1))
    mean = DUO.mean(brightness * currents_a(6e-3, -1e-3, 1e-4))
    assert mean.x_m == pytest.approx(6e-3)
    assert mean.x_sigma_m < 1e-12


def test_layers_that_disagree_are_seen():
    good = currents_a(1e-3, 2e-3, 1e-4)
    assert layer_mismatch(good) < 1e-12
    assert layer_mismatch(good * [1.0, 1.0, 0.9, 0.9]) == pytest.approx(0.1 / 0.95)
    assert np.isnan(layer_mismatch(np.zeros(4)))


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="x1, x2, y1, y2"):
        DUO.read(np.zeros((3, 8)))
    with pytest.raises(ValueError, match="sample >= 2"):
        DUO.mean(np.zeros((1, 4)))
    with pytest.raises(ValueError, match=r"QUADRANT: metres need the radius of the spot; give spot_radius_m"):
        Face(FaceKind.QUADRANT, L_M)
