"""fleet.html: which robots drift, which share a cause, how good each is now, which recordings failed and why."""

from collections.abc import Sequence
from pathlib import Path

from calibeam.fleet.drift import FEWEST, all_series
from calibeam.fleet.figures import over_time, who_shares
from calibeam.fleet.row import Row
from calibeam.fleet.summary import Fleet, drift_words, method_words, shared_words
from calibeam.software import SOFTWARE
from calibrate.report.elements import Html, bullets, figure, folded, join, page, section, table, tag, tile, write_page
from calibrate.report.quantities import DASH, angle, doubted_angle, fixed, length, significant

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
    return page(f"Fleet: {title}", _masthead(fleet, title), contents, [c for _, c in kept], SOFTWARE)


def _masthead(fleet: Fleet, title: str) -> Html:
    return tag(
        "header",
        tag("p", "A fleet of robots", cls="kicker"),
        tag("h1", title),
        tag("p", f"{len(fleet.robots)} robots, {len(fleet.rows)} recordings · {SOFTWARE}", cls="byline"),
    )


def _short(fleet: Fleet) -> Html:
    lead = "What a reader in a hurry should know; the chapters below hold each figure."
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
        sentence = "No joint zero of any robot is seen to drift."
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
    rest = f" {len(robots) - PANELS} more robots stand in the table." if len(robots) > PANELS else ""
    caption = f"Zeros less their own mean, one mark and colour a joint, the clearest drift first.{rest}"
    drawing = tag("div", figure(over_time(shown, fleet.drifting), caption), cls="wide")
    rows = [
        (
            d.series.robot,
            f"J{d.series.joint}",
            str(d.series.dates),
            doubted_angle(d.slope_rad_year, d.sigma_rad_year),
            f"{angle(d.low_rad_year, 2)} to {angle(d.high_rad_year, 2)}",
            angle(d.change_rad, 2),
            significant(d.p, 2),
            "drifts" if d.significant else "not seen to",
        )
        for d in fleet.lines[:LISTED]
    ]
    head = ("Robot", "joint", "dates", "a year, one sigma", "95 % of this line", "first to last", "p", "verdict")
    listed = table(head, rows, numeric=(2, 3, 5, 6))
    told = (tag("p", method_words(fleet.drifts)), folded("Every line", listed)) if rows else ()
    return section("drift", CONTENTS["drift"], lead, drawing, *told)


def _causes(fleet: Fleet) -> Html | None:
    if not fleet.diagnosed:
        return None
    lead = (
        f"What the diagnosis found in {fleet.diagnosed} recordings, by place and physics. What one robot alone has is "
        "its own trouble; what many have comes from a part, a fixture, or how it was measured."
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
    told = [shared_words(cause) for cause in fleet.shared]
    alone = tag("p", "No cause was found on more than one robot.")
    return section(
        "causes", CONTENTS["causes"], lead, tag("div", drawing, cls="wide"), bullets(told) if told else alone
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
        "has not seen. Tool error: rms over the workspace, nominal against calibrated, and the predicted "
        "error of the calibrated arm."
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
    head = ("Robot", "recorded", "unseen rows", "tool error", "diagnosis", "trust")
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
    told = sum(zero.value_rad is not None for zero in row.zeros)
    return (
        row.robot,
        row.started_utc[:10] or DASH,
        row.name if row.complete else f"{row.name} (cut short or damaged)",
        str(row.samples),
        f"{told} of {len(row.zeros)}",
        _change(row.held_out_before_m, row.held_out_after_m),
        ", ".join(f"{c.physics} at {c.where}" for c in row.causes) or (row.verdict or DASH),
        fixed(row.seconds, 1),
    )


def _change(before_m: float | None, after_m: float | None) -> str:
    said = [DASH if value is None else length(value, 3) for value in (before_m, after_m)]
    return DASH if said == [DASH, DASH] else " → ".join(said)


def _more(count: int) -> Sequence[Html]:
    return (tag("p", f"{count - LISTED} more are in fleet.parquet."),) if count > LISTED else ()
