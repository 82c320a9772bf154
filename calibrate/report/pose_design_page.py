"""A design as one page; figures of how many poses are enough, how they use the joints, and which causes look alike."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from acquisition.recording.rig import Rig
from calibrate.design import Design, Places, Seen
from calibrate.diagnose.assess import Named
from calibrate.quantities import length
from calibrate.report.diagnosis.words import size_of
from calibrate.report.elements.html import (
    Html,
    bullets,
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

SHOWN_MM = 1.0  # of the curve: beyond, there are fewer readings than unknowns, and priors alone speak


def curve_figure(made: Design) -> Html:
    """Predicted error by number of poses."""
    says = "curve of the predicted error over the workspace over the number of poses"
    return drawn("design-curve", says, 6.0, 3.4, lambda figure: paint_curve(figure, made))


def paint_curve(figure: Figure, made: Design) -> None:
    """Chosen one by one, drawn at random, and the plan."""
    axes, curve = figure.subplots(), made.curve
    shown = curve.random_m < 1e-3 * SHOWN_MM
    axes.plot(curve.poses[shown], 1e6 * curve.random_m[shown], "--", color=Tone.SOFT.value, label="random, median")
    axes.plot(curve.poses[shown], 1e6 * curve.chosen_m[shown], color=PLACES[0].value, label="one by one")
    axes.plot(len(made.taken.poses), 1e6 * made.free_space_m, "o", color=PLACES[1].value, label="the plan, exchanged")
    if curve.enough is not None:
        axes.axvline(curve.enough, color=Tone.SOFT.value, lw=0.8)
        axes.annotate("enough", (curve.enough, 1.0), xycoords=("data", "axes fraction"), fontsize=8, va="top")
    values = 1e6 * np.concatenate([curve.chosen_m[shown], curve.random_m[shown]])
    log_axis(axes, "y", [float(values.min()), float(values.max())], lambda y: f"{y:g}")
    axes.set(xlabel="poses", ylabel="predicted error over the workspace, rms (µm)")
    axes.legend()


def joints_figure(made: Design) -> Html:
    """Angles of every joint in time."""
    says = "angles of every joint over the number of the pose in the plan"
    return drawn("design-joints", says, 9.0, 3.2, lambda figure: _paint_joints(figure, made))


def _paint_joints(figure: Figure, made: Design) -> None:
    axes, q = figure.subplots(), np.degrees(made.candidates.q_rad[made.taken.poses])
    number, place = np.arange(1, len(q) + 1), made.candidates.placement[made.taken.poses]
    for joint, angle in enumerate(q.T):
        axes.plot(number, angle, ".", color=PLACES[joint % len(PLACES)].value, label=f"J{joint + 1}", ms=4)
    for change in np.flatnonzero(np.diff(place)):
        axes.axvline(change + 1.5, color=Tone.SOFT.value, lw=0.8)
    axes.set(xlabel="pose in time (lines: the fixture is moved)", ylabel="angle (°)")
    axes.legend(ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.2))


def isolability_figure(seen: Seen) -> Html:
    """R2 between physics."""
    says = "matrix of how much of the signal of each cause every other could explain"
    return drawn("design-isolability", says, 9.4, 8.2, lambda figure: paint_isolability(figure, seen))


def paint_isolability(figure: Figure, seen: Seen) -> None:
    """The largest R2 of any two terms of each two physics, the same place or not."""
    names = list(dict.fromkeys(term.physics for term in seen.isolability.terms))
    owner = np.array([names.index(term.physics) for term in seen.isolability.terms])
    r2 = seen.isolability.r2.copy()
    np.fill_diagonal(r2, 0.0)
    table = np.zeros((len(names), len(names)))
    for a in range(len(names)):
        for b in range(len(names)):
            block = r2[np.ix_(owner == a, owner == b)]
            table[a, b] = block.max(initial=0.0)
    axes = figure.subplots()
    axes.grid(visible=False)
    for a in range(len(names)):
        for b in range(len(names)):
            share = float(table[a, b])
            tone = PLACES[1].value if share >= 0.97 else PLACES[0].value
            axes.fill_between([b - 0.5, b + 0.5], a - 0.5, a + 0.5, color=tone, alpha=0.03 + 0.7 * share, lw=0)
            if share >= 0.5:
                axes.text(b, a, f"{100.0 * share:.0f}", ha="center", va="center", fontsize=7)
    axes.set(xlim=(-0.5, len(names) - 0.5), ylim=(len(names) - 0.5, -0.5))
    axes.set(xlabel="by so much (%) could this cause explain it", ylabel="signal of this cause")
    axes.set_xticks(range(len(names)), names, rotation=90, fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)


CONTENTS = {"promise": "How many poses", "plan": "The plan", "places": "Stations of the fixture", "causes": "Causes"}


def write_page_of(path: Path, rig: Rig, made: Design, seen: Seen, places: Sequence[Places], software: str) -> Path:
    """One HTML file. DataError where it cannot be written."""
    said = (f"{len(made.taken.poses)} poses", f"criterion {made.asked.criterion}", software)
    masthead = tag(
        "header",
        tag("p", "Design of a session", cls="kicker"),
        tag("h1", rig.name),
        tag("p", " · ".join(said), cls="byline"),
        _tiles(made, seen),
    )
    chapters = [_promise(made), _plan(made), _places(places), _causes(seen)]
    contents = CONTENTS if places else {k: v for k, v in CONTENTS.items() if k != "places"}
    kept = chapters if places else [chapters[0], chapters[1], chapters[3]]
    return write_page(path, page(f"Design for {rig.name}", masthead, contents, kept, software, kind="pose design"))


def _tiles(made: Design, seen: Seen) -> Html:
    enough = "more than shown" if made.curve.enough is None else str(made.curve.enough)
    return tag(
        "div",
        tile("Predicted error", length(made.free_space_m), f"rms over the workspace:  {made.information.target}"),
        tile("Random poses", length(made.random_m), "as many, median of draws"),
        tile("Enough", enough, "poses; more of them do little but average noise"),
        tile("Alike", str(len(seen.confusable_causes)), "pairs of causes that could not be separated"),
        cls="tiles",
    )


def _promise(made: Design) -> Html:
    caption = f"Predicted rms error over the workspace. {of_the_curve(made)}"
    return section("promise", CONTENTS["promise"], "What more poses would bring.", figure(curve_figure(made), caption))


def of_the_curve(made: Design) -> str:
    """Why plan and curve differ at the same number of poses."""
    return (
        f"The plan was chosen by exchanging all its poses (criterion {made.asked.criterion}). The curve adds one pose "
        "after the other (criterion d): quicker, but not as good. The plan may therefore lie below the curve, even "
        "where the curve has more poses; the curve shows how the error falls, the plan what to expect."
    )


def _plan(made: Design) -> Html:
    order = made.in_time
    lead = (
        f"Of a steady drift of laser, joints or fixture geometry would absorb {100.0 * order.absorbed:.0f} %; in the "
        f"order of shortest ways it would be {100.0 * order.absorbed_before:.0f} %."
    )
    return section(
        "plan", CONTENTS["plan"], lead, figure(joints_figure(made), "Joint angles in the order of the plan.")
    )


def _places(places: Sequence[Places]) -> Html:
    rows = [
        (
            ", ".join(map(str, one.ids)),
            length(one.free_space_m),
            f"{1e6 * one.scale_sigma:.1f} ppm",
            length(one.with_distances_m),
            f"{1e6 * one.with_distances_scale:.1f} ppm",
            "yes" if one.distances_needed else "no",
        )
        for one in places
    ]
    head = ("stations", "error", "scale", "with distances", "scale", "distances needed")
    lead = "As many poses, shared out over the best one, two, three ... stations of the rig and of a grid about them."
    return section("places", CONTENTS["places"], lead, table(head, rows, numeric=range(1, 5)))


def _causes(seen: Seen) -> Html:
    rows = [(one.name.physics, one.name.where, size_of(one.parameter, one.value)) for one in seen.smallest]
    alike = [f"{_name(a)} and {_name(b)}: R2 {r2:.3f}" for a, b, r2 in seen.confusable_causes]
    caption = (
        "Largest share, in percent, of the signal of a cause (row) that any form of another one (column) could "
        "explain, geometry refitted. From 97 % on the poses cannot separate them."
    )
    return section(
        "causes",
        CONTENTS["causes"],
        "What a diagnosis of this plan could find, and what it would confuse.",
        figure(isolability_figure(seen), caption),
        tag("h3", "Could not be separated"),
        bullets(alike or ["nothing"]),
        *([tag("h3", "Not shown at all"), bullets([_name(one) for one in seen.invisible])] if seen.invisible else []),
        tag("h3", "Found from this size on, 19 times out of 20"),
        table(("cause", "at", "size"), rows),
    )


def _name(name: Named) -> str:
    return f"{name.physics} at {name.where} ({', '.join(name.depends_on)})"
