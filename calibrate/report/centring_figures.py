"""How the servo brought the spots to where they were wanted: error against step, and how many steps it took."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from calibrate.report.centring_traces import Trace
from calibrate.report.elements import Html
from calibrate.report.quantities import length, stated
from calibrate.report.svg import drawn, log_axis
from calibrate.report.tones import Tone, place_mark, tone_of

FLOOR_M = 1e-8  # an error of exactly zero has no place on a log axis
DRAWN = 120  # traces in one picture; of more, every n-th


def courses(runs: Sequence[Trace], tolerance_m: float, places: Sequence[int], name: str) -> Html:
    """Error against step, one line a run, colour by placement."""
    says = f"error of {len(runs)} centring runs against the step"
    return drawn(name, says, 4.6, 2.9, lambda figure: _paint_courses(figure, runs, tolerance_m, places))


def step_counts(runs: Sequence[Trace], tolerance_m: float, name: str) -> Html:
    """How many runs took how many steps."""
    says = f"histogram of the steps of {len(runs)} centring runs to {stated(tolerance_m)}"
    return drawn(name, says, 4.6, 2.9, lambda figure: _paint_counts(figure, runs))


def _paint_courses(figure: Figure, runs: Sequence[Trace], tolerance_m: float, places: Sequence[int]) -> None:
    axes = figure.add_subplot()
    for run in runs[:: -(-len(runs) // DRAWN)]:
        number = places.index(run.placement) if run.placement in places else None
        tone, mark = (Tone.SOFT, {}) if number is None else (tone_of(number), place_mark(number))
        shown = np.maximum(run.error_m, FLOOR_M)
        axes.plot(shown, "o-", color=tone.value, lw=1.0, ms=3.4, alpha=0.6, **mark)  # pyright: ignore[reportArgumentType]
    axes.axhline(tolerance_m, color=Tone.INK.value, lw=1.2, linestyle=(0, (4, 3)))
    axes.annotate(
        f"wanted: {stated(tolerance_m)}",
        (1.0, tolerance_m),
        xycoords=("axes fraction", "data"),
        xytext=(0, 4),
        textcoords="offset points",
        ha="right",
        fontsize=10,
    )
    seen = np.concatenate([[tolerance_m], *(run.error_m[np.isfinite(run.error_m)] for run in runs)])
    log_axis(axes, "y", np.maximum(seen, FLOOR_M).tolist(), lambda value: length(value, 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="step", title="Largest distance of a spot from its target")


def _paint_counts(figure: Figure, runs: Sequence[Trace]) -> None:
    axes = figure.add_subplot()
    steps = np.array([run.steps for run in runs])
    counts = np.bincount(steps)
    bars = axes.bar(np.arange(len(counts)), counts, width=0.72, color=Tone.SOFT.value)
    axes.bar_label(bars, labels=[str(c) if c else "" for c in counts], padding=2, fontsize=10)
    axes.margins(y=0.12)
    axes.grid(visible=False)
    axes.spines["left"].set_visible(False)
    axes.set_yticks([])
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="steps", title="Runs that took so many steps", xlim=(-0.6, max(len(counts), 6) - 0.4))
