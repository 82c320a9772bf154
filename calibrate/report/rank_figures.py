"""What the data can see at all: the singular values with their gap."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from calibrate.identifiability import WEAK
from calibrate.report.elements import Html
from calibrate.report.quantities import power_of_ten
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone

Floats = NDArray[np.float64]

DRAWING = 2.0**0.5  # s^2 = data + 1 for a combination of toleranced links: below, the drawing tells more than the data


def spectrum(singular_values: Floats, rank: int, name: str, *, with_drawing: bool = True) -> Html:
    """Singular values in falling order on a log axis; hollow: not seen."""
    says = f"{len(singular_values)} singular values, {rank} of them above the threshold"
    return drawn(name, says, 4.8, 3.6, lambda figure: _paint_spectrum(figure, singular_values, rank, with_drawing))


def _paint_spectrum(figure: Figure, s: Floats, rank: int, with_drawing: bool) -> None:
    axes = figure.add_subplot()
    axes.set_yscale("log")
    number = np.arange(1, len(s) + 1)
    shown = np.maximum(s, np.finfo(float).eps * s[0])  # below is rounding, and zero has no place on a log axis
    drawing = np.zeros(len(s), dtype=bool) if not with_drawing else s < DRAWING
    drawing[rank:] = False
    data = ~drawing
    data[rank:] = False
    for rows, tone, mark, filled, label in (
        (data, Tone.PLACE_1, "o", True, "known from the data"),
        (drawing, Tone.PLACE_5, "s", True, "known from the nominal values"),
        (number > rank, Tone.BEAM, "o", False, "not known"),
    ):
        if rows.any():
            face = tone.value if filled else "none"
            text = f"{label}: {int(rows.sum())}"
            axes.plot(number[rows], shown[rows], mark, ms=5, mfc=face, mec=tone.value, mew=1.4, label=text)
    axes.axhline(WEAK, color=Tone.INK.value, lw=1.1, linestyle=(0, (4, 3)))
    axes.annotate("worse than a guess", (1.0, WEAK), (2, -11), textcoords="offset points", fontsize=10)
    axes.yaxis.set_major_formatter(FuncFormatter(_power))
    axes.set(xlabel="combination of parameters", title="Plausible size over sigma, of each combination")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.08))


def _power(value: float, _: int | None) -> str:
    return power_of_ten(round(np.log10(value)))
