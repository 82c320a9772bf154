"""errors.html: an error simulation as one page; figures of each error alone, gains, linear beside drawn, shares,
budget.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from calibrate.error_simulation import BINS, ROUNDING_M, SHARE, Simulation, Single
from calibrate.quantities import angle, length, significant
from calibrate.report.elements.html import (
    Html,
    figure,
    page,
    section,
    table,
    tag,
    tile,
    write_page,
)
from calibrate.report.elements.svg import drawn, log_axis
from calibrate.report.elements.tones import PLACES, Tone

SCALES = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "K": (1.0, "K")}
STYLES = {"-": "solid", "--": "dashed", ":": "dotted"}
RANKED = 20
COLUMNS = ("x", "y", "z", "roll", "pitch", "yaw", "zero")


@dataclass(frozen=True)
class Picture:
    """A figure: what it is called, its size, its text for who cannot see it and for who can, and its painter."""

    name: str
    width_in: float
    height_in: float
    says: str
    caption: str
    paint: Callable[[Figure, Simulation], None]

    def painter(self, simulation: Simulation) -> Callable[[Figure], None]:
        """What draws it onto a figure."""
        return (lambda figure: self.paint(figure, simulation)) if simulation.moves else _paint_nothing


def _paint_nothing(figure: Figure) -> None:
    figure.text(0.5, 0.5, "none of these errors moves the probe", ha="center", va="center")


def _paint_alone(figure: Figure, s: Simulation) -> None:
    groups = list(dict.fromkeys(one.group for one in s.singles))
    rows = -(-len(groups) // 3)
    grid = figure.subplots(rows, min(3, len(groups)), squeeze=False).ravel()
    for axes, group in zip(grid, groups, strict=False):
        _curves(axes, group, [one for one in s.singles if one.group == group])
    for axes in grid[len(groups) :]:
        axes.set_axis_off()


def _curves(axes: Axes, group: str, singles: Sequence[Single]) -> None:
    """Places by colour, what is off there by style; of one place alone, what is off by colour."""
    scale, unit = SCALES[singles[0].unit]
    split = [(place, word) for place, _, word in (one.name.partition(".") for one in singles)]
    if len({place for place, _ in split}) == 1:
        split = [(word, "") for _, word in split]
    places, words = list(dict.fromkeys(p for p, _ in split)), list(dict.fromkeys(w for _, w in split))
    tones, styles = (*PLACES, Tone.INK), list(STYLES)
    for one, (place, word) in zip(singles, split, strict=True):
        tone, style = tones[places.index(place) % len(tones)].value, styles[words.index(word) % len(styles)]
        label = place if word == words[0] else None
        axes.plot(scale * one.value, 1e3 * one.rms_m, style, color=tone, label=label, lw=1.2)
    lines = f": {', '.join(f'{word} {STYLES[style]}' for style, word in zip(styles, words, strict=False))}"
    largest = max(float(one.rms_m.max()) for one in singles)
    axes.set(title=group, xlabel=f"error ({unit}){lines if len(words) > 1 else ''}", ylabel="probe, rms (mm)")
    axes.set_ylim(0.0, 1.35e3 * largest if largest > ROUNDING_M else 1.0)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.legend(loc="upper center", ncols=4, fontsize=7, handlelength=1.0, columnspacing=0.8)


def _paint_gains(figure: Figure, s: Simulation) -> None:
    gains = {one.name: one.gain for one in s.singles}
    parts = s.machine.n_joints + 1
    table = np.full((parts, len(COLUMNS)), np.nan)
    for part in range(parts):
        for column, word in enumerate(COLUMNS):
            name = f"joint{part + 1}.zero" if word == "zero" else f"link{part}.{word}"
            table[part, column] = gains.get(name, np.nan)
    axes = figure.subplots()
    axes.grid(visible=False)
    top = float(np.nanmax(table)) if np.isfinite(table).any() else 1.0
    for part in range(parts):
        for column in range(len(COLUMNS)):
            value = table[part, column]
            if np.isfinite(value):
                share = value / top
                axes.fill_between([column - 0.5, column + 0.5], part - 0.5, part + 0.5, color=Tone.PLACE_1.value,
                                  alpha=0.05 + 0.55 * share, lw=0)  # fmt: skip
                axes.text(column, part, f"{value:.2f}", ha="center", va="center", fontsize=9)
    axes.set(xlim=(-0.5, len(COLUMNS) - 0.5), ylim=(parts - 0.5, -0.5))
    axes.set_xticks(range(len(COLUMNS)), [*COLUMNS[:-1], "zero of the joint behind"])
    axes.set_yticks(range(parts), [f"link {i}" for i in range(parts)])
    axes.set_title("probe error by unit of each error (mm per mm, mm per mrad)")


def _paint_side_by_side(figure: Figure, s: Simulation) -> None:
    left, right = figure.subplots(1, 2)
    poses = np.arange(1, len(s.drawn_at_rad) + 1)
    left.bar(poses - 0.2, 1e3 * s.linear.rms_m, 0.38, color=Tone.PLACE_6.value, label="linear")
    left.bar(poses + 0.2, 1e3 * s.drawn.rms_m, 0.38, color=Tone.PLACE_1.value, label="drawn")
    left.set(xlabel="pose", ylabel="probe error, rms (mm)", title="rms at every pose")
    left.set_xticks(poses)
    left.legend(loc="upper left", ncols=2)
    left.set_ylim(0.0, 1.25e3 * max(float(s.linear.rms_m.max()), float(s.drawn.rms_m.max())))
    pose = int(np.argmax(s.drawn.rms_m))
    edges = s.drawn.bin_m[pose] * np.arange(BINS + 1)
    counts = s.drawn.histogram[pose, :BINS].reshape(-1, 8).sum(axis=1)
    density = counts / s.drawn.arms / (8e3 * s.drawn.bin_m[pose])
    right.stairs(density, 1e3 * edges[::8], color=Tone.PLACE_1.value, fill=True, alpha=0.35, label="drawn")
    x, expected = _length_density(s, pose)
    right.plot(1e3 * x, 1e-3 * expected, color=Tone.PLACE_2.value, lw=1.4, label="linear, normal law")
    right.set(xlabel="probe error (mm)", ylabel="per mm", title=f"lengths of the error at pose {pose + 1}")
    right.set_xlim(0.0, 1e3 * 1.3 * float(s.drawn.quantile_m(0.999)[pose]))
    right.legend(loc="upper right")


def _length_density(s: Simulation, pose: int) -> tuple[np.ndarray, np.ndarray]:
    """Of the length of a normal vector of the linear mean and covariance, by drawing it."""
    covariance = s.linear.covariance_m2.sum(axis=0)[pose]
    rng = np.random.default_rng(s.asked.seed)
    length = np.linalg.norm(rng.multivariate_normal(s.linear.bias_m[pose], covariance, 200_000), axis=1)
    counts, edges = np.histogram(length, 100, density=True)
    return (edges[1:] + edges[:-1]) / 2.0, counts


def _paint_shares(figure: Figure, s: Simulation) -> None:
    axes, top = figure.subplots(), s.ranking[:RANKED]
    y = np.arange(len(top))
    axes.barh(y, 100.0 * s.shares.total[top], 0.7, xerr=100.0 * s.shares.total_sigma[top], color=Tone.PLACE_6.value,
              alpha=0.6, ecolor=Tone.SOFT.value, label="total")  # fmt: skip
    axes.errorbar(100.0 * s.shares.first[top], y, xerr=100.0 * s.shares.first_sigma[top], fmt="o", ms=4,
                  color=Tone.PLACE_1.value, label="first order")  # fmt: skip
    axes.plot(100.0 * s.wide.shares[top], y, "|", ms=12, color=Tone.PLACE_2.value, label="linear, wide workspace")
    axes.set_yticks(y, [s.sources[i].name for i in top])
    axes.invert_yaxis()
    axes.set(xlabel="share of the variance of the probe error (%)", xlim=(0.0, None))
    axes.legend(loc="lower right")


def _paint_budget(figure: Figure, s: Simulation) -> None:
    axes, budget = figure.subplots(), s.budget
    y = np.arange(len(budget))
    value = np.array([1e3 * line.rms_m for line in budget])
    shown = value[value > 1e3 * ROUNDING_M]
    axes.barh(y, value, 0.7, color=Tone.PLACE_1.value)
    for i, line in enumerate(budget):
        says = f"{value[i]:.3g} mm, {100.0 * line.share:.2g} %"
        axes.text(max(value[i], shown.min()) * 1.08, i, says, va="center", fontsize=9)
    log_axis(axes, "x", [float(shown.min()), 8.0 * float(shown.max())], lambda x: f"{x:g}")
    axes.set_xlabel("probe error over the workspace, this group alone, rms (mm)")
    axes.set_yticks(y, [f"{line.group} ({line.sources})" for line in budget])
    axes.invert_yaxis()


PICTURES = (
    Picture("budget", 8.6, 3.0, "bars of the error budget by group", "What each group of errors makes of the probe "
            "error when it acts alone; the share is of the variance of all together.", _paint_budget),
    Picture("alone", 10.6, 6.4, "curves of the probe error over the size of each error alone", "Each error alone, from "
            "minus to plus three of its sizes: rms of the probe error over 100 poses of the workspace, by the arm "
            "itself. Lines that cover each other do the same.", _paint_alone),
    Picture("gains", 7.4, 4.0, "table of the probe error by unit of each link and joint error", "Gain of every error "
            "of links and joint zeros: rms over the workspace of how far the probe goes for one unit.", _paint_gains),
    Picture("side-by-side", 10.0, 3.6, "bars of linear and drawn errors at some poses, and a histogram", "Linear "
            "propagation beside drawn arms.", _paint_side_by_side),
    Picture("shares", 7.8, 5.6, "bars of Sobol indices of the most important errors", "First-order and total Sobol "
            "indices with their sigma; marks are the shares by linear propagation over all poses of the workspace.",
            _paint_shares),
)  # fmt: skip


CONTENTS = {"budget": "Budget", "each": "Each error alone", "linear": "Linear and drawn", "ranking": "Ranking",
            "worst": "Worst postures"}  # fmt: skip


def write_page_of(path: Path, simulation: Simulation, software: str) -> Path:
    """One HTML file. DataError where it cannot be written."""
    s = simulation
    said = (f"{len(s.sources)} errors", f"{s.drawn.arms:,} arms at each of {len(s.drawn_at_rad)} poses", software)
    masthead = tag(
        "header",
        tag("p", "Error simulation of an arm", cls="kicker"),
        tag("h1", s.machine.name),
        tag("p", " · ".join(said), cls="byline"),
        _tiles(s),
    )
    chapters = (_budget(s), _each(s), _linear(s), _ranking(s), _worst(s))
    return write_page(
        path, page(f"Errors of {s.machine.name}", masthead, CONTENTS, chapters, software, kind="error simulation")
    )


def _tiles(s: Simulation) -> Html:
    rms = float(np.sqrt(np.mean(s.wide.rms_m**2)))
    moved = s.linear.rms_m > ROUNDING_M
    apart = float(np.max(np.abs(s.drawn.rms_m[moved] / s.linear.rms_m[moved] - 1.0), initial=0.0))
    return tag(
        "div",
        tile("Probe error", length(rms), "rms over the workspace, three axes together"),
        tile("Worst posture", length(s.worst[0].rms_m if s.worst else 0.0), "rms, by linear propagation"),
        tile("Largest source", s.sources[s.ranking[0]].name, f"{100.0 * s.shares.total[s.ranking[0]]:.1f} % in total"),
        tile("Linear against drawn", f"{100.0 * apart:.2f} %", "largest difference of an rms"),
        cls="tiles",
    )


def _picture(name: str, s: Simulation) -> Html:
    one: Picture = next(p for p in PICTURES if p.name == name)
    drawing = drawn(f"errors-{name}", one.says, one.width_in, one.height_in, one.painter(s))
    return figure(drawing, one.caption)


def _budget(s: Simulation) -> Html:
    return section("budget", "Budget", "Which group of errors the probe error comes from.", _picture("budget", s))


def _each(s: Simulation) -> Html:
    lead = "One error at a time, all others none; over the whole workspace."
    return section("each", CONTENTS["each"], lead, _picture("alone", s), _picture("gains", s))


def _linear(s: Simulation) -> Html:
    p95 = s.drawn.quantile_m(SHARE)
    rows = [
        (
            str(i + 1),
            ", ".join(f"{np.degrees(q):.0f}°" for q in s.drawn_at_rad[i]),
            length(float(s.linear.rms_m[i])),
            length(float(s.drawn.rms_m[i])),
            length(float(p95[i])),
            length(float(s.drawn.worst_m[i])),
        )
        for i in range(len(s.drawn_at_rad))
    ]
    head = ("pose", "joints", "linear rms", "drawn rms", "95 % below", "worst arm")
    lead = (
        "Linear propagation is immediate and gives the causes; random arms need no linearisation and take any "
        "distribution."
    )
    return section(
        "linear", CONTENTS["linear"], lead, _picture("side-by-side", s), table(head, rows, numeric=range(2, 6))
    )


def _ranking(s: Simulation) -> Html:
    rows = [
        (
            s.sources[i].name,
            f"{s.sources[i].law.name}, {_size(s.sources[i].unit, s.sources[i].law.scale)}",
            length(float(s.wide.alone_m[i])),
            f"{100.0 * s.wide.shares[i]:.2f} %",
            f"{100.0 * s.shares.first[i]:.2f} ± {100.0 * s.shares.first_sigma[i]:.2f} %",
            f"{100.0 * s.shares.total[i]:.2f} ± {100.0 * s.shares.total_sigma[i]:.2f} %",
        )
        for i in s.ranking
    ]
    head = ("error", "law, scale", "alone, rms", "linear", "first order", "total")
    lead = (
        "All errors, the most important first. Where total and first order differ, errors act together. Linear shares "
        f"are over {len(s.wide_rad)} poses of the workspace, Sobol indices over {s.shares.poses} of these."
    )
    listing = table(head, rows, numeric=range(2, 6))
    return section("ranking", CONTENTS["ranking"], lead, _picture("shares", s), listing)


def _size(unit: str, value: float) -> str:
    return length(value) if unit == "m" else angle(value) if unit == "rad" else f"{significant(value)} K"


def _worst(s: Simulation) -> Html:
    rows = [
        (
            length(p.rms_m),
            ", ".join(f"{np.degrees(q):.0f}°" for q in p.q_rad),
            ", ".join(f"{x:.3f}" for x in p.probe_m),
        )
        for p in s.worst
    ]
    if not s.worst:
        return section("worst", CONTENTS["worst"], "None of these errors moves the probe in any posture.")
    lead = "Tops of the error over the joint ranges; postures of the same error are listed once."
    return section("worst", CONTENTS["worst"], lead, table(("rms", "joints", "probe in the base (m)"), rows))
