"""A few gross errors do not flatten the curve of all others, and are counted instead."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from calibrate.report.figures.error_figures import FARTHEST, paint_histogram, paint_quantiles


@pytest.fixture
def outliers():
    values = np.random.default_rng(3).normal(size=300)
    values[[7, 90]] = 400.0, -1e6
    return np.sort(values)


@pytest.mark.parametrize("paint", [paint_quantiles, paint_histogram])
def test_gross_errors_stand_at_the_rim(outliers, paint):
    figure = Figure()
    paint(figure, outliers)
    axes = figure.axes[0]
    low, high = axes.get_ylim() if paint is paint_quantiles else axes.get_xlim()
    assert -1.2 * FARTHEST < low < high < 1.2 * FARTHEST
    assert "2 beyond ±8" in axes.get_title()


def test_bars_hold_every_value(outliers):
    figure = Figure()
    paint_histogram(figure, outliers)
    assert sum(bar.get_height() for bar in figure.axes[0].patches) == len(outliers)


def test_without_gross_errors_nothing_is_said():
    figure = Figure()
    paint_histogram(figure, np.random.default_rng(3).normal(size=300))
    assert "beyond" not in figure.axes[0].get_title()
