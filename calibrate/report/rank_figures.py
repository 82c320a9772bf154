"""What the data can see at all: the singular values with their gap, and how well each zero is known."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from calibrate.identifiability import WEAK
from calibrate.report.elements import Html
from calibrate.report.quantities import angle
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone
from calibrate.zeros.result import JointZero

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
    shown = np.maximum(s, 1e-13 * s[0])
    drawing = np.zeros(len(s), dtype=bool) if not with_drawing else s < DRAWING
    drawing[rank:] = False
    data = ~drawing
    data[rank:] = False
    for rows, tone, filled, label in (
        (data, Tone.PLACE_1, True, "known from the data"),
        (drawing, Tone.PLACE_5, True, "known from the drawing"),
        (number > rank, Tone.BEAM, False, "not known"),
    ):
        if rows.any():
            face = tone.value if filled else "none"
            text = f"{label}: {int(rows.sum())}"
            axes.plot(number[rows], shown[rows], "o", ms=5, mfc=face, mec=tone.value, mew=1.4, label=text)
    axes.axhline(WEAK, color=Tone.INK.value, lw=1.1, linestyle=(0, (4, 3)))
    axes.annotate("worse than a guess", (1.0, WEAK), (2, -11), textcoords="offset points", fontsize=9)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))
    axes.set(xlabel="combination of parameters", title="Plausible size over sigma, of each combination")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 0.08))


def _power(value: float) -> str:
    """'10⁵' without mathematics fonts."""
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    return "10" + f"{np.log10(value):.0f}".translate(raised)


def doubts(zeros: Sequence[JointZero]) -> Html:
    """Sigma of every determined zero, and what the measurement alone leaves of it."""
    says = "sigma of each joint zero on a logarithmic axis, in all and of the measurement alone"
    return drawn("zero-doubts", says, 4.8, 0.9 + 0.42 * len(zeros), lambda figure: _paint_doubts(figure, zeros))


def _paint_doubts(figure: Figure, zeros: Sequence[JointZero]) -> None:
    axes = figure.add_subplot()
    axes.set_xscale("log")
    alone, total = ("measurement alone", "in all") if zeros else (None, None)
    for row, zero in enumerate(zeros):
        if zero.sigma_rad is None:
            continue
        least = zero.measurement_sigma_rad or zero.sigma_rad
        axes.plot([least, zero.sigma_rad], [row, row], color=Tone.SOFT.value, lw=1.6, zorder=1)
        paper = {"mfc": Tone.PAPER.value, "mec": Tone.PLACE_1.value, "mew": 1.6}
        axes.plot(least, row, "o", ms=6.5, label=alone, **paper)  # pyright: ignore[reportArgumentType]
        axes.plot(zero.sigma_rad, row, "o", ms=7, color=Tone.PLACE_1.value, label=total)
        alone = total = None
    for row, zero in enumerate(zeros):
        if zero.sigma_rad is None:
            axes.annotate(
                "not determined",
                (0.01, row),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=9,
                color=Tone.SOFT.value,
            )
    axes.set_yticks(range(len(zeros)), [f"J{z.joint}" for z in zeros])
    axes.tick_params(axis="y", length=0, colors=Tone.INK.value)
    axes.set_ylim(len(zeros) - 0.5, -0.5)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: angle(value, 1)))
    axes.set_title("One sigma of each zero")
    if any(z.sigma_rad is not None for z in zeros):
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0, fontsize=8.5)
