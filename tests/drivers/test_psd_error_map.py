"""The error map of a face: measured from known spots, applied, kept in a file."""

import json

import numpy as np
import pytest

from drivers.psd_error_map import ErrorMap, MapStatus, fit_error_map

HALF_M = 5e-3
GRID = np.array([(x, y) for x in np.linspace(-4e-3, 4e-3, 9) for y in np.linspace(-4e-3, 4e-3, 9)])


def shown_m(true_m: np.ndarray) -> np.ndarray:
    """A cushion of 120 um in the corner, a gain 2 % low in x, 10 mrad of cross-talk, an offset: what a face does."""
    u, v = (true_m / HALF_M).T
    x_m = 0.98 * true_m[:, 0] + 0.01 * true_m[:, 1] + 20e-6 - 120e-6 * u * v**2 - 40e-6 * u**3
    y_m = 1.01 * true_m[:, 1] - 0.01 * true_m[:, 0] - 10e-6 - 120e-6 * v * u**2 - 40e-6 * v**3
    return np.stack([x_m, y_m], axis=1)


def test_a_map_from_some_points_corrects_others():
    half, other = GRID[::2], GRID[1::2][np.abs(GRID[1::2]).max(axis=1) < 3.9e-3]
    fit = fit_error_map(half, shown_m(half), HALF_M)
    assert fit.status is MapStatus.GOOD
    assert fit.map is not None
    assert fit.before_m > 80e-6
    miss_m = np.stack(fit.map.correct(*shown_m(other).T), axis=1) - other
    assert np.sqrt((miss_m**2).sum(axis=1).mean()) < 4e-6  # the map is a series, the face here is another's inverse


def test_sigmas_are_the_scatter_of_the_coefficients():
    rng = np.random.default_rng(3)
    fits = [fit_error_map(GRID, GRID + 2e-6 * rng.standard_normal(GRID.shape), HALF_M).map for _ in range(300)]
    found = np.array([fit.x_m for fit in fits])
    stated = np.sqrt(np.mean([np.array(fit.x_sigma_m) ** 2 for fit in fits], axis=0))
    np.testing.assert_allclose(stated, found.std(axis=0), rtol=0.2)  # 5 sigma of 300 draws
    np.testing.assert_allclose(found.mean(axis=0), [0.0, HALF_M, 0.0, 0.0, 0.0], atol=1e-6)


def test_beyond_the_points_nothing_is_said():
    fit = fit_error_map(GRID, GRID, HALF_M)
    assert fit.map is not None
    x_m, y_m = fit.map.correct([4e-3, 4.1e-3, 0.0], [0.0, 0.0, -4.1e-3])
    assert np.isfinite([x_m[0], y_m[0]]).all()
    assert np.isnan([x_m[1], y_m[1], x_m[2], y_m[2]]).all()


def test_points_that_cannot_tell_give_no_numbers():
    line = GRID[GRID[:, 0] == GRID[:, 1]]
    assert fit_error_map(line, shown_m(line), HALF_M).status is MapStatus.RANK_DEFICIENT
    assert fit_error_map(line, shown_m(line), HALF_M).map is None
    nine = np.array([(x, y) for x in (-4e-3, 0.0, 4e-3) for y in (-4e-3, 0.0, 4e-3)])
    assert fit_error_map(nine, nine, HALF_M).status is MapStatus.RANK_DEFICIENT  # three steps: u and u^3 are the same
    assert fit_error_map(GRID[:5], GRID[:5], HALF_M).status is MapStatus.TOO_FEW_POINTS
    assert fit_error_map(np.zeros((9, 2)), np.zeros((9, 2)), HALF_M).status is MapStatus.RANK_DEFICIENT


@pytest.mark.parametrize("points", [np.zeros((9, 3)), np.zeros(9), np.full((9, 2), np.nan)])
def test_points_that_are_none_are_refused(points):
    with pytest.raises(ValueError, match="points"):
        fit_error_map(points, points, HALF_M)


def test_a_map_survives_its_file(tmp_path):
    made = fit_error_map(GRID, shown_m(GRID), HALF_M).map
    (tmp_path / "psd1.json").write_text(made.text())
    assert ErrorMap.load(tmp_path / "psd1.json") == made


@pytest.mark.parametrize(
    "spoil",
    [
        lambda held: held | {"format": "another"},
        lambda held: {key: value for key, value in held.items() if key != "y_m"},
        lambda held: held | {"x_m": [1.0]},
        lambda held: held | {"half_length_m": 0.0},
        lambda held: [held],
    ],
)
def test_a_file_that_is_no_map_is_named(tmp_path, spoil):
    path = tmp_path / "psd1.json"
    path.write_text(fit_error_map(GRID, GRID, HALF_M).map.text())
    path.write_text(json.dumps(spoil(json.loads(path.read_text()))))
    with pytest.raises(ValueError, match=r"psd1.json: no error map of format"):
        ErrorMap.load(path)


def test_a_file_far_larger_than_a_map_is_refused_before_it_is_parsed(tmp_path):
    path = tmp_path / "psd1.json"
    path.write_text("[" + "{}," * 400_000 + "{}]")
    with pytest.raises(ValueError, match=r"psd1\.json: no error map .*larger than 1 MB.*measure one"):
        ErrorMap.load(path)
