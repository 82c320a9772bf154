"""Pictures of a fleet: zeros of each robot over time, and which causes which robots share."""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from calibeam.fleet.drift import YEAR_S, Drift, Series
from calibeam.fleet.summary import Shared
from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.tones import PLACES, Tone

COLUMNS = 3
PANEL_IN = 2.35
MARKS = ("o", "s", "^", "D", "v", "P", "X")  # beside the colour: joints are separated without it, too
ASIDE = 0.008  # of the span of dates, by which joints stand beside each other so that their bars can be seen
UNITS = ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad"))
CELL_IN = 0.34
DAYS_TOLD = 0.3  # years: over less, a month says too little


def over_time(robots: Sequence[tuple[str, Sequence[Series]]], drifting: Sequence[Drift]) -> Html:
    """One panel a robot: every joint's zero less its own mean, with two sigma; a line where it drifts."""
    says = "change of every joint zero over time, one panel a robot"
    rows = -(-len(robots) // COLUMNS)
    lines = {(d.series.robot, d.series.joint): d for d in drifting}
    years = np.concatenate([one.year for _, series in robots for one in series])

    def paint(figure: Figure) -> None:
        grid = figure.subplots(rows, COLUMNS, squeeze=False, sharex=True).ravel()
        for axes, (robot, series) in zip(grid, robots, strict=False):
            _paint_robot(axes, robot, series, lines)
            _date_ticks(axes, float(years.min()), float(years.max()))
        for axes in grid[len(robots) :]:
            axes.set_axis_off()
        handles = {label: h for axes in grid for h, label in zip(*axes.get_legend_handles_labels(), strict=True)}
        names = sorted(handles)
        figure.legend(
            [handles[n] for n in names], names, loc="outside lower center", ncols=7, fontsize=10, handlelength=1.0
        )

    return drawn("zeros-over-time", says, 9.9, 0.6 + PANEL_IN * rows, paint)


def _paint_robot(axes: Axes, robot: str, series: Sequence[Series], lines: dict[tuple[str, int], Drift]) -> None:
    means = [float(np.average(s.zero_rad, weights=s.sigma_rad**-2.0)) for s in series]
    reach = max(float(np.max(np.abs(s.zero_rad - m) + 2.0 * s.sigma_rad)) for s, m in zip(series, means, strict=True))
    size, unit = next(((s, n) for s, n in UNITS if reach >= s), UNITS[-1])
    span = max(float(np.ptp(np.concatenate([s.year for s in series]))), 1e-3)
    for one, mean in zip(series, means, strict=True):
        tone = PLACES[(one.joint - 1) % len(PLACES)].value
        aside = ASIDE * span * (one.joint - 3.5)
        axes.errorbar(
            one.year + aside,
            (one.zero_rad - mean) / size,
            2.0 * one.sigma_rad / size,
            fmt=MARKS[(one.joint - 1) % len(MARKS)],
            ms=4.5,
            lw=1.0,
            color=tone,
            label=f"joint {one.joint}",
        )
        drift = lines.get((robot, one.joint))
        if drift is not None:
            ends = np.array([one.year.min(), one.year.max()])
            axes.plot(ends, (drift.line_rad(ends) - mean) / size, color=tone, lw=2.0)
            axes.annotate(
                f"J{one.joint} drifts", (0.03, 0.97), xycoords="axes fraction", va="top", fontsize=9, fontweight="bold"
            )
    axes.axhline(0.0, color=Tone.SOFT.value, lw=0.8)
    axes.set_title(robot if len(robot) < 30 else f"{robot[:28]}…")
    axes.set_ylabel(f"zero less mean ({unit})")
    axes.tick_params(axis="x", labelbottom=True)


def _date_ticks(axes: Axes, low_year: float, high_year: float) -> None:
    """Three dates, written as long as the span asks for."""
    ticks = np.linspace(low_year, high_year, 3) if high_year > low_year else np.array([low_year])
    form = "%Y-%m" if high_year - low_year > DAYS_TOLD else "%Y-%m-%d"
    axes.set_xticks(ticks, [datetime.fromtimestamp(float(tick) * YEAR_S, UTC).strftime(form) for tick in ticks])
    axes.set_xlim(low_year - 0.08 * (high_year - low_year), high_year + 0.08 * (high_year - low_year))


def who_shares(causes: Sequence[Shared], robots: Sequence[str]) -> Html:
    """A cell for every cause and robot: in how many of its recordings it was found; empty where it never was."""
    says = "in how many recordings of each robot each cause was found"
    width, height = 3.2 + CELL_IN * max(len(robots), 6), 1.1 + CELL_IN * len(causes)

    def paint(figure: Figure) -> None:
        axes = figure.subplots()
        axes.grid(visible=False)
        for i, cause in enumerate(causes):
            for j, robot in enumerate(robots):
                shown, of = cause.robots.get(robot, (0, 0))
                if shown:
                    tone = Tone.PLACE_1.value
                    axes.add_patch(
                        Rectangle((j - 0.46, i - 0.46), 0.92, 0.92, color=tone, alpha=0.15 + 0.45 * shown / of, lw=0)
                    )
                    axes.text(j, i, f"{shown}/{of}", ha="center", va="center", fontsize=9)
        for low, high in pairwise(range(len(causes) + 1)):
            if low:
                axes.axhline((low + high) / 2.0 - 1.0, color=Tone.FAINT.value, lw=0.8)
        axes.set_xticks(range(len(robots)), [r if len(r) < 24 else f"{r[:22]}…" for r in robots], rotation=40)
        for label in axes.get_xticklabels():
            label.set_horizontalalignment("left")
        axes.xaxis.tick_top()
        axes.set_yticks(range(len(causes)), [f"{c.physics} at {c.where}" for c in causes])
        axes.tick_params(length=0, colors=Tone.INK.value)
        axes.set_xlim(-0.5, max(len(robots), 6) - 0.5)
        axes.set_ylim(len(causes) - 0.5, -0.5)
        axes.set_aspect("equal", anchor="W")
        for side in ("left", "bottom"):
            axes.spines[side].set_visible(False)

    return drawn("who-shares", says, width, height, paint)
