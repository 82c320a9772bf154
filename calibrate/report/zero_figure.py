"""How well each joint zero is known, as a figure."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from calibrate.identification.estimates import JointZero
from calibrate.report.elements import Html
from calibrate.report.quantities import angle
from calibrate.report.svg import drawn, log_axis
from calibrate.report.tones import Tone

ROW_IN = 0.3


def doubts(zeros: Sequence[JointZero]) -> Html:
    """Sigma of every determined zero, and what the measurement alone leaves of it."""
    says = "sigma of each joint zero on a logarithmic axis, in all and of the measurement alone"
    return drawn("zero-doubts", says, 4.8, 1.0 + ROW_IN * len(zeros), lambda figure: _paint_doubts(figure, zeros))


def _paint_doubts(figure: Figure, zeros: Sequence[JointZero]) -> None:
    axes = figure.add_subplot()
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
                fontsize=10,
                color=Tone.SOFT.value,
            )
    axes.set_yticks(range(len(zeros)), [f"J{z.joint}" for z in zeros])
    axes.tick_params(axis="y", length=0, colors=Tone.INK.value)
    axes.set_ylim(len(zeros) - 0.5, -0.5)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")
    sizes = [s for z in zeros for s in (z.sigma_rad, z.measurement_sigma_rad) if s]
    log_axis(axes, "x", sizes, lambda value: angle(value, 1))
    axes.set_title("One sigma of each zero")
    if any(z.sigma_rad is not None for z in zeros):
        axes.legend(loc="upper right", bbox_to_anchor=(1.0, -0.16), ncols=2, borderaxespad=0.0)
