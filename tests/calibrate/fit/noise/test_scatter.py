"""Noise of an instrument from its residuals alone."""

import numpy as np
import pytest

from calibrate.diagnose.state.linearised import tame
from calibrate.fit.noise.scatter import scatter_of, sigma_about_zero


def test_columns_that_follow_others_have_a_noise_too() -> None:
    """A line of targets: six columns of residuals that two numbers a row decide, and far beyond what was assumed."""
    rng = np.random.default_rng(1)
    residual = 300.0 * rng.standard_normal((60, 2)) @ rng.standard_normal((2, 6))
    found = scatter_of(residual, np.zeros((60, 6, 1)), np.ones((60, 6)))
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0
    spread = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2)).mean(axis=0)
    assert np.all(np.abs(np.log(spread / residual.std(axis=0))) < 0.3)


@pytest.mark.parametrize("alike", [[slice(None)], [slice(0, 3), slice(3, 6)]])
def test_of_few_rows_a_coordinate_that_a_fit_reaches_everywhere_is_no_better_than_the_others(alike) -> None:
    """Fewer rows than an arm has unknowns: one coordinate may be fitted exactly, and would have all the weight."""
    k = alike[-1].stop or 3
    residual = np.random.default_rng(4).standard_normal((19, k)) * np.repeat([1.0, 20.0], 3)[:k]
    residual[:, 2] = 0.0
    found = scatter_of(residual, np.zeros((19, k, 1)), np.ones((19, k)), alike)
    each = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2)).mean(axis=0)
    for part in alike:
        assert each[part] == pytest.approx(each[part][0])
    assert each[-1] / each[0] == pytest.approx(20.0 if len(alike) > 1 else 1.0, rel=0.5)


def test_a_gross_error_is_not_tame_and_readings_of_which_each_seems_outlying_all_are() -> None:
    misfit = np.random.default_rng(2).standard_normal((40, 3))
    misfit[7] *= 100.0
    assert np.flatnonzero(~tame(misfit, 1.0)).tolist() == [7]
    one_component = 1e-9 * misfit
    one_component[:, 2] = 1.0
    assert np.all(tame(one_component, 1e-300))


def test_sigma_about_zero_is_that_of_normal_noise_and_hardly_follows_gross_errors() -> None:
    noise = np.random.default_rng(3).standard_normal((4000, 2)) * [1e-3, 5e-3]
    assert sigma_about_zero(noise, axis=0) == pytest.approx([1e-3, 5e-3], rel=0.05)
    noise[::50] += 1.0
    assert sigma_about_zero(noise, axis=0) == pytest.approx([1e-3, 5e-3], rel=0.08)
    assert sigma_about_zero(noise[:, 0] + 1.0) == pytest.approx(1.0 / 0.6745, rel=0.01)  # about zero: offsets count
