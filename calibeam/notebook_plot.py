"""The picture of a notebook: error of every reading before and after the fit, in the order of the session."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from calibeam.results.identification import ReadingErrors

BEFORE, AFTER = "#d55e00", "#0072b2"  # Okabe and Ito, Color Universal Design, 2008
MICRO = 1e6


def errors_along_session(found: Sequence[ReadingErrors]) -> Figure:
    """One panel a quantity; µm, of orientations µrad, on a logarithmic axis."""
    figure = Figure(figsize=(8.0, 1.0 + 2.4 * len(found)), layout="constrained")
    for axes, one in zip(figure.subplots(len(found), 1, squeeze=False).ravel(), found, strict=True):
        number = np.arange(len(one.after)) + 1
        for values, colour, mark, label in (
            (one.before, BEFORE, "x", "arm as drawn"),
            (one.after, AFTER, "o", "identified"),
        ):
            axes.plot(number, MICRO * _positive(values), mark, ms=4, color=colour, label=f"{label}: {_rms(values)} rms")
        unit = "µm" if one.unit == "m" else "µrad"
        axes.set(yscale="log", xlabel="reading", ylabel=f"error ({unit})", title=one.title)
        axes.legend(loc="best", fontsize=9)
    return figure


def _positive(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a logarithmic axis can show; NaN draws nothing."""
    return np.where(values > 0.0, values, np.nan)


def _rms(values: NDArray[np.float64]) -> str:
    return f"{MICRO * float(np.sqrt(np.mean(values**2))):.3g}"
