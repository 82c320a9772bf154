"""fleet.html: which robots drift, which share a cause, how good each is now, which recordings failed and why.

Figures: the zeros of each robot over time, and which causes which robots share.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from calibeam.fleet.drift import FEWEST, YEAR_S, Drift, Series, all_series
from calibeam.fleet.row import Row
from calibeam.fleet.summary import Fleet, Shared, drift_words, method_words, shared_words
from calibeam.software import SOFTWARE
from calibrate.quantities import (
    DASH,
    angle,
    angle_with_sigma,
    fixed,
    length,
    significant,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    folded,
    join,
    page,
    section,
    table,
    tag,
    tile,
    write_page,
)
from calibrate.report.elements.svg import drawn
from calibrate.report.elements.tones import PLACES, Tone

GRID_COLUMNS = 3
PANEL_IN = 2.35
MARKS = ("o", "s", "^", "D", "v", "P", "X")  # beside the colour: joints are separated without it, too
ASIDE = 0.008  # of the span of dates, by which joints stand beside each other so that their bars can be seen
UNITS = ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad"))
CELL_IN = 0.34
DAYS_BELOW_YEARS = 0.3  # years: over less, a month means too little


def over_time(robots: Sequence[tuple[str, Sequence[Series]]], drifting: Sequence[Drift]) -> Html:
    """One panel a robot: every joint's zero less its own mean, with two sigma; a line where it drifts."""
    says = "change of every joint zero over time, one panel a robot"
    rows = -(-len(robots) // GRID_COLUMNS)
    lines = {(d.series.robot, d.series.joint): d for d in drifting}
    years = np.concatenate([one.year for _, series in robots for one in series])

    def paint(figure: Figure) -> None:
        grid = figure.subplots(rows, GRID_COLUMNS, squeeze=False, sharex=True).ravel()
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
    form = "%Y-%m" if high_year - low_year > DAYS_BELOW_YEARS else "%Y-%m-%d"
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


PANELS = 12  # robots with a picture: those that drift first
COLUMNS = 30  # robots in the picture of shared causes
CAUSES = 25
LISTED = 300  # rows of a list; the table holds all
CONTENTS = {
    "short": "In short",
    "drift": "Which zeros drift",
    "causes": "Which causes are shared",
    "now": "How good each robot is now",
    "failed": "What failed, and why",
    "all": "Every recording",
}


def write_fleet_page(path: Path, fleet: Fleet, title: str) -> Path:
    """One HTML file at `path`; returns it. DataError where it cannot be written."""
    return write_page(path, fleet_html(fleet, title))


def fleet_html(fleet: Fleet, title: str) -> str:
    """The page as text."""
    chapters = [_short(fleet), _drift(fleet), _causes(fleet), _now(fleet), _failed(fleet), _all(fleet)]
    kept = [(anchor, chapter) for anchor, chapter in zip(CONTENTS, chapters, strict=True) if chapter is not None]
    contents = {anchor: CONTENTS[anchor] for anchor, _ in kept}
    return page(f"Fleet: {title}", _masthead(fleet, title), contents, [c for _, c in kept], SOFTWARE, kind="fleet")


def _masthead(fleet: Fleet, title: str) -> Html:
    return tag(
        "header",
        tag("p", "A fleet of robots", cls="kicker"),
        tag("h1", title),
        tag("p", f"robots: {len(fleet.robots)}, recordings: {len(fleet.rows)} · {SOFTWARE}", cls="byline"),
    )


def _short(fleet: Fleet) -> Html:
    lead = "The main results; the chapters below hold each figure."
    tiles = [
        tile("Robots", str(len(fleet.robots)), f"in {len(fleet.good)} recordings that gave numbers"),
        tile("Drift", str(len({d.series.robot for d in fleet.drifting})), f"robots; {len(fleet.lines)} zeros tested"),
        tile(
            "Shared causes",
            str(len(fleet.shared)) if fleet.diagnosed else DASH,
            "found on two robots or more" if fleet.diagnosed else "nothing was diagnosed: --diagnose",
        ),
        tile("Failed", str(len(fleet.bad)), f"of {len(fleet.rows)} recordings; {len(fleet.empty)} hold no sample"),
    ]
    return section("short", CONTENTS["short"], lead, _verdict(fleet), tag("div", *tiles, cls="tiles"))


def _verdict(fleet: Fleet) -> Html:
    robots = len({d.series.robot for d in fleet.drifting})
    said = [drift_words(d) for d in fleet.drifting[:PANELS]] + [shared_words(c) for c in fleet.shared[:PANELS]]
    if robots:
        sentence = f"{robots} of {len(fleet.robots)} robots {'drifts' if robots == 1 else 'drift'}."
    elif fleet.lines:
        sentence = "No joint zero of any robot drifts significantly."
    else:
        sentence = (
            f"No robot was recorded on {FEWEST} dates with a zero that can be determined: drift is not determined."
        )
    advice = (
        ("Calibrate these again, and find what moved: an encoder's clamp, a belt, a collision.",) if robots else ()
    ) + (("A cause of several robots: check what they have in common before you repair each.",) if fleet.shared else ())
    body = [tag("strong", sentence)]
    body += [bullets(said)] if said else []
    body += [tag("p", tag("b", "What to do")), bullets(advice)] if advice else []
    return tag("div", *body, cls=f"verdict {'care' if robots or fleet.shared else 'good' if fleet.lines else 'care'}")


def _drift(fleet: Fleet) -> Html | None:
    series = [s for s in all_series(fleet.rows) if len(s.year) > 1]
    if not series:
        return None
    lead = (
        "True joint angle = reading + zero. Each point is one recording with two sigma either way; a line is drawn "
        "where the zero drifts by more than its uncertainty and the number of zeros tested explain."
    )
    order = [d.series.robot for d in fleet.lines] + [s.robot for s in series]
    robots = list(dict.fromkeys(order))
    shown = [(robot, [s for s in series if s.robot == robot]) for robot in robots[:PANELS]]
    rest = f" Robots that are only in the table: {len(robots) - PANELS}." if len(robots) > PANELS else ""
    caption = f"Zeros less their own mean, one mark and colour a joint, the clearest drift first.{rest}"
    drawing = tag("div", figure(over_time(shown, fleet.drifting), caption), cls="wide")
    rows = [
        (
            d.series.robot,
            f"J{d.series.joint}",
            str(d.series.dates),
            angle_with_sigma(d.slope_rad_year, d.sigma_rad_year),
            f"{angle(d.low_rad_year, 2)} to {angle(d.high_rad_year, 2)}",
            angle(d.change_rad, 2),
            significant(d.p, 2),
            "drifts" if d.significant else "not seen to",
        )
        for d in fleet.lines[:LISTED]
    ]
    head = ("Robot", "joint", "dates", "a year, one sigma", "95 % of this line", "first to last", "p", "verdict")
    listed = table(head, rows, numeric=(2, 3, 5, 6))
    details = (tag("p", method_words(fleet.drifts)), folded("Every line", listed)) if rows else ()
    return section("drift", CONTENTS["drift"], lead, drawing, *details)


def _causes(fleet: Fleet) -> Html | None:
    if not fleet.diagnosed:
        return None
    lead = (
        f"Causes found, by place and physics; recordings diagnosed: {fleet.diagnosed}. A cause of one robot alone "
        "lies in that robot; a cause of many lies in a common part, a fixture, or the way of measuring."
    )
    if not fleet.causes:
        return section("causes", CONTENTS["causes"], lead, tag("p", "No cause was found in any of them."))
    robots = _most_causes_first(fleet)
    showing = sum(any(c.robots[robot][0] for c in fleet.causes) for robot in robots)
    drawing = figure(
        who_shares(fleet.causes[:CAUSES], robots[:COLUMNS]),
        f"In how many recordings of each robot each cause was found: {showing} of {len(robots)} robots show one or more"
        f"{f'; the {COLUMNS} with most are drawn' if len(robots) > COLUMNS else ''}.",
    )
    causes = [shared_words(cause) for cause in fleet.shared]
    alone = tag("p", "No cause was found on more than one robot.")
    return section(
        "causes", CONTENTS["causes"], lead, tag("div", drawing, cls="wide"), bullets(causes) if causes else alone
    )


def _most_causes_first(fleet: Fleet) -> list[str]:
    """All robots that were diagnosed; there is a cause at least."""
    count = {robot: sum(c.robots[robot][0] > 0 for c in fleet.causes) for robot in fleet.causes[0].robots}
    return sorted(count, key=lambda robot: (-count[robot], robot))


def _now(fleet: Fleet) -> Html | None:
    newest = fleet.newest()
    if not newest:
        return None
    lead = (
        "The last recording of each robot, a whole one where there is one. Unseen rows: rms error on rows that the fit "
        "has not seen. Geometry error: rms of the tool between the joint limits, nominal against calibrated, then one "
        "sigma of the calibrated geometry; the tool error in a report also has the scatter of a single pose."
    )
    rows = [
        (
            row.robot,
            row.started_utc[:10] or DASH,
            _change(row.held_out_before_m, row.held_out_after_m),
            _change(row.free_space_before_m, row.free_space_after_m),
            row.verdict or DASH,
            row.trust or DASH,
        )
        for row in newest[:LISTED]
    ]
    head = ("Robot", "recorded", "unseen rows", "geometry error", "diagnosis", "trust")
    return section("now", CONTENTS["now"], lead, table(head, rows), *_more(len(newest)))


def _failed(fleet: Fleet) -> Html | None:
    if not fleet.bad and not fleet.empty:
        return None
    lead = (
        "Failed: by what is in the file, and it would fail again. Lost: its process died or took too long; the next "
        "run tries again."
    )
    rows = [(row.name, row.outcome.value, row.error) for row in (*fleet.bad, *fleet.empty)]
    return section(
        "failed", CONTENTS["failed"], lead, table(("Recording", "how", "why"), rows[:LISTED]), *_more(len(rows))
    )


def _all(fleet: Fleet) -> Html:
    lead = "The same rows, with all their numbers, are in fleet.parquet: any table program or pandas opens it."
    rows = [_line(row) for row in sorted(fleet.rows, key=lambda row: (row.robot, row.started_utc, row.name))]
    head = ("Robot", "recorded", "recording", "samples", "zeros", "unseen rows", "causes", "s")
    listed = table(head, rows[:LISTED], numeric=(3, 4, 7))
    return section("all", CONTENTS["all"], lead, folded(f"{len(rows)} recordings", join(listed, *_more(len(rows)))))


def _line(row: Row) -> tuple[str, ...]:
    if not row.good:
        return (row.robot or DASH, row.started_utc[:10] or DASH, row.name, row.error)
    determined = sum(zero.value_rad is not None for zero in row.zeros)
    return (
        row.robot,
        row.started_utc[:10] or DASH,
        row.name if row.complete else f"{row.name} (cut short or damaged)",
        str(row.samples),
        f"{determined} of {len(row.zeros)}",
        _change(row.held_out_before_m, row.held_out_after_m),
        ", ".join(f"{c.physics} at {c.where}" for c in row.causes) or (row.verdict or DASH),
        fixed(row.seconds, 1),
    )


def _change(before_m: float | None, after_m: float | None) -> str:
    said = [DASH if value is None else length(value, 3) for value in (before_m, after_m)]
    return DASH if said == [DASH, DASH] else " → ".join(said)


def _more(count: int) -> Sequence[Html]:
    return (tag("p", f"Rows that are only in fleet.parquet: {count - LISTED}."),) if count > LISTED else ()
