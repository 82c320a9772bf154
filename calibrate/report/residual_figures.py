"""Whether what the model leaves of the readings looks like noise."""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtri

from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone

Floats = NDArray[np.float64]

MOST_POINTS = 800  # of the ordered residuals: beyond, the page grows and the eye sees no more
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
    if n <= MOST_POINTS:
        return np.arange(1, n + 1)
    tail = MOST_POINTS // 4
    middle = np.linspace(tail, n - tail, MOST_POINTS // 2).astype(np.intp)
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
