"""A design as one page."""

from collections.abc import Sequence
from pathlib import Path

from acquisition.recording.rig import Rig
from calibrate.diagnose.diagnosis import Named
from calibrate.pose_design.design import Design
from calibrate.pose_design.places import Places
from calibrate.pose_design.seen import Seen
from calibrate.report.diagnosis.words import size_of
from calibrate.report.elements import Html, bullets, figure, page, section, table, tag, tile, write_page
from calibrate.report.pose_design.figures import curve_figure, isolability_figure, joints_figure
from calibrate.report.quantities import length

CONTENTS = {"promise": "How many poses", "plan": "The plan", "places": "Places of the fixture", "causes": "Causes"}


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
    return write_page(path, page(f"Design for {rig.name}", masthead, contents, kept, software))


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
    head = ("places", "error", "scale", "with distances", "scale", "distances needed")
    lead = "As many poses, shared out over the best one, two, three ... places of the rig and of a grid about them."
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
