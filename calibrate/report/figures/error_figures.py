"""Figures of the error of every reading before and after the fit: how large, when, along which joint, noise or not."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtri

from calibrate.quantities import fixed
from calibrate.report.elements.html import Html
from calibrate.report.elements.svg import drawn, log_axis
from calibrate.report.elements.tones import PLACES, Tone
from calibrate.report.evidence.session_evidence import Readings
from calibrate.report.evidence.session_verdict import Pattern

Floats = NDArray[np.float64]

MOST_POINTS = 1200  # of a scatter: beyond, the page grows and the eye sees no more
BINS = 28
COLUMNS = 4
STROKES = ("-", "--", ":", "-.")  # beside the colours
AXES = {3: ("x", "y", "z"), 4: ("PSD 1 x", "PSD 1 y", "PSD 2 x", "PSD 2 y"), 1: ("length",)}


def errors(readings: Readings) -> Html:
    """Histogram of the length of the misfit before and after, on a logarithmic axis."""
    says = f"histogram of the errors of {readings.title} before and after the fit"
    return drawn(f"errors-{readings.name}", says, 4.8, 3.3, lambda figure: _paint_errors(figure, readings))


def _paint_errors(figure: Figure, readings: Readings) -> None:
    axes = figure.add_subplot()
    sets = (
        ("nominal", readings.error_before, Tone.PLACE_2, "////"),
        ("calibrated", readings.error_after, Tone.PLACE_1, ""),
    )
    sizes = np.concatenate([values[values > 0.0] for _, values, _, _ in sets])
    if len(sizes) == 0:
        axes.set_axis_off()
        return
    edges = np.geomspace(max(sizes.min(), 1e-4 * np.median(sizes)), sizes.max() * 1.001, BINS)
    for label, values, tone, hatch in sets:
        rms = readings.says(float(np.sqrt(np.mean(values**2))))
        axes.hist(values, bins=edges.tolist(), color=tone.value, alpha=0.6, hatch=hatch, label=f"{label}: {rms} rms")
    axes.set(ylabel="readings", title=f"{readings.title}: error")
    log_axis(axes, "x", [float(edges[0]), float(edges[-1])], lambda value: readings.says(value, 1))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.14), ncols=2, borderaxespad=0.0)


def by_sample(readings: Readings) -> Html:
    """Length of the misfit against the number of the sample."""
    says = f"errors of {readings.title} against the number of the sample, before and after the fit"
    return drawn(f"by-sample-{readings.name}", says, 4.8, 3.3, lambda figure: _paint_by_sample(figure, readings))


def _paint_by_sample(figure: Figure, readings: Readings) -> None:
    axes = figure.add_subplot()
    shown = thinned(len(readings.rows))
    number = readings.rows[shown, 0] + 1
    before, after = readings.error_before[shown], readings.error_after[shown]
    for values, tone, mark, label in (
        (before, Tone.PLACE_2, "+", "nominal"),
        (after, Tone.PLACE_1, ".", "calibrated"),
    ):
        some = values > 0.0
        axes.plot(number[some], values[some], mark, ms=3.4, mew=0.7, color=tone.value, alpha=0.65, label=label)
    sizes = np.concatenate([before, after])
    sizes = sizes[sizes > 0.0]
    if len(sizes):
        log_axis(
            axes, "y", [float(np.quantile(sizes, 0.002)), float(sizes.max())], lambda value: readings.says(value, 1)
        )
    axes.set(xlabel="sample", title="Error in the order of the session")
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.2), ncols=2, borderaxespad=0.0)


def thinned(n: int) -> NDArray[np.intp]:
    """Evenly spread observations, no more than a page can show."""
    return np.arange(n) if n <= MOST_POINTS else np.linspace(0, n - 1, MOST_POINTS).astype(np.intp)


def along(readings: Readings, found: Sequence[Pattern]) -> Html:
    """Means of groups of readings along each factor with two sigma, all on one scale."""
    says = f"mean residual of {readings.title} along every joint angle and along the session"
    rows = -(-len(found) // COLUMNS)
    return drawn(
        f"along-{readings.name}", says, 9.9, 0.5 + 2.1 * rows, lambda figure: _paint_along(figure, readings, found)
    )


def _paint_along(figure: Figure, readings: Readings, found: Sequence[Pattern]) -> None:
    rows = -(-len(found) // COLUMNS)
    reach = max(float(np.max(np.abs(p.mean) + 2.0 * p.sigma)) for p in found)
    scale, unit = _unit(reach, readings.unit)
    grid = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False).ravel()
    names = AXES.get(found[0].mean.shape[1], tuple(str(i + 1) for i in range(found[0].mean.shape[1])))
    for axes, p in zip(grid, found, strict=False):
        middle = np.degrees(p.middle) if p.factor.startswith("J") else p.middle
        axes.axhline(0.0, color=Tone.SOFT.value, lw=0.8)
        for k, name in enumerate(names):
            tone = PLACES[k % len(PLACES)].value
            axes.fill_between(
                middle, *(scale * (p.mean[:, k] + s * p.sigma[:, k]) for s in (-2.0, 2.0)), color=tone, alpha=0.18, lw=0
            )
            axes.plot(middle, scale * p.mean[:, k], STROKES[k % len(STROKES)], color=tone, lw=1.3, label=name)
        where = f"{p.factor} (°)" if p.factor.startswith("J") else p.factor
        axes.set(title=f"{where}: F = {fixed(p.f, 1)}{', clear' if p.clear else ''}")
    for axes in grid[len(found) :]:
        axes.set_axis_off()
    for axes in grid[::COLUMNS]:
        axes.set_ylabel(f"mean residual ({unit})")
    if len(names) > 1:
        handles, labels = grid[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower left", ncols=len(names), handlelength=1.4, fontsize=10)


def _unit(reach: float, unit: str) -> tuple[float, str]:
    sizes = {"m": ((1e3, "mm"), (1e6, "µm")), "rad": ((1e3, "mrad"), (1e6, "µrad"))}[unit]
    return sizes[0] if reach * sizes[0][0] >= 0.3 else sizes[1]


MOST_RESIDUALS = 800  # of the ordered residuals: beyond, the page grows and the eye sees no more
CORRIDOR = 0.95  # pointwise, of the order statistics
FARTHEST = 8.0  # sigmas that are drawn to scale: values beyond stand at the rim, else a few would flatten all others


def quantiles(whitened: Floats, name: str = "residual-quantiles") -> Html:
    """Whitened residuals in order against those of a normal law, with the corridor in which 95 % of each should lie.

    Source: order statistics of n uniform numbers follow Beta(i, n + 1 - i) (David, Nagaraja, Order Statistics, 2003).
    """
    says = "ordered residuals in units of their noise against the quantiles of a normal law"
    return drawn(name, says, 4.6, 3.2, lambda figure: paint_quantiles(figure, np.sort(whitened.ravel())))


def paint_quantiles(figure: Figure, ordered: Floats) -> None:
    """Values in rising order; those beyond FARTHEST as diamonds at the rim."""
    axes = figure.add_subplot()
    n = len(ordered)
    rank = _ranks_to_show(n)
    ordered = ordered[rank - 1]
    expected = ndtri((rank - 0.5) / n)
    low, high = (ndtri(betaincinv(rank, n + 1 - rank, p)) for p in ((1 - CORRIDOR) / 2, (1 + CORRIDOR) / 2))
    axes.fill_between(expected, low, high, color=Tone.FAINT.value, lw=0)
    axes.plot(expected, expected, color=Tone.SOFT.value, lw=0.9)
    near = np.abs(ordered) <= FARTHEST
    axes.plot(expected[near], ordered[near], "o", ms=2.8, color=Tone.PLACE_1.value, mew=0)
    if not near.all():
        rim = np.copysign(FARTHEST, ordered[~near])
        axes.plot(expected[~near], rim, "D", ms=4.5, mfc="none", color=Tone.BEAM.value, clip_on=False)
    axes.set(xlabel="expected of pure noise (sigma)", ylabel="found (sigma)", title=_titled("Ordered residuals", near))


def _titled(title: str, near: NDArray[np.bool_]) -> str:
    """With the number of values that stand at the rim instead of in their place."""
    beyond = int(np.sum(~near))
    return f"{title}; {beyond} beyond ±{FARTHEST:g}" if beyond else title


def _ranks_to_show(n: int) -> NDArray[np.intp]:
    """From 1: all, or as many as a page can hold, with every one of both tails."""
    if n <= MOST_RESIDUALS:
        return np.arange(1, n + 1)
    tail = MOST_RESIDUALS // 4
    middle = np.linspace(tail, n - tail, MOST_RESIDUALS // 2).astype(np.intp)
    return np.unique(np.concatenate([np.arange(1, tail + 1), middle, np.arange(n - tail + 1, n + 1)]))


def histogram(whitened: Floats, name: str = "residual-histogram") -> Html:
    """The same residuals as a histogram beside the normal law."""
    says = "histogram of the residuals in units of their noise beside the normal law"
    return drawn(name, says, 4.6, 3.2, lambda figure: paint_histogram(figure, whitened.ravel()))


def paint_histogram(figure: Figure, values: Floats) -> None:
    """All values; those beyond FARTHEST in the outermost bars."""
    axes = figure.add_subplot()
    near = np.abs(values) <= FARTHEST
    reach = min(max(4.0, float(np.ceil(np.abs(values).max()))), FARTHEST)
    width = reach / 12.0 if reach <= 6.0 else reach / 24.0
    inside = 1.0 - 1e-9  # the outermost bars hold what is beyond
    axes.hist(
        np.clip(values, -inside * reach, inside * reach),
        bins=np.arange(-reach, reach + width, width).tolist(),
        color=Tone.PLACE_1.value,
        alpha=0.55,
    )
    x = np.linspace(-reach, reach, 160)
    axes.plot(x, np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi) * len(values) * width, color=Tone.INK.value, lw=1.4)
    axes.set(xlabel="residual (sigma)", ylabel="coordinates", title=_titled("Residuals, pure noise (line)", near))
