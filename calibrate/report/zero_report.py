"""Writes the report of a dual-PSD session: one HTML file that needs nothing else, on a screen, a phone or on paper."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from acquisition.recording.recording import Recording
from calibrate.errors import DataError
from calibrate.read_samples import Angles
from calibrate.report.elements import Html, join, tag
from calibrate.report.evidence import Evidence, evidence
from calibrate.report.sections import centring, point, provenance, residuals, rig, spots, summary, unseen, zeros
from calibrate.zeros.point_constraint import PointConstraintResult
from calibrate.zeros.result import ZeroResult

# The browser itself refuses anything from outside: https://www.w3.org/TR/CSP3/
POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def write_report(
    path: Path | str,
    recording: Recording,
    result: ZeroResult,
    *,
    point_constraint: PointConstraintResult | None = None,
    why_no_point_constraint: str = "it was not asked for",
    angles: Angles = "reported",
    left_out: Sequence[str] = (),
) -> Path:
    """One HTML file at `path`, over what may be there; returns it.

    `left_out` are sentences, each naming rows that were recorded but not fitted.
    `result` must come from `recording` with these `angles`. DataError if it does not, or the file cannot be written.
    """
    page = report_html(
        recording,
        result,
        point_constraint=point_constraint,
        why_no_point_constraint=why_no_point_constraint,
        angles=angles,
        left_out=left_out,
    )
    try:
        Path(path).write_text(page, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: the report cannot be written ({error.strerror}); give another place") from error
    return Path(path)


def report_html(
    recording: Recording,
    result: ZeroResult,
    *,
    point_constraint: PointConstraintResult | None = None,
    why_no_point_constraint: str = "it was not asked for",
    angles: Angles = "reported",
    left_out: Sequence[str] = (),
) -> str:
    """The page as text; arguments as in `write_report`."""
    known = evidence(recording, result, angles)
    chapters = (
        summary.summary(known),
        rig.rig(known),
        spots.spots(known),
        centring.centring(known),
        residuals.residuals(known),
        zeros.zeros(known),
        point.point(point_constraint, result.zeros, why_no_point_constraint),
        unseen.unseen(known, left_out),
        provenance.provenance(known),
    )
    return _page(known, chapters)


def _page(known: Evidence, chapters: tuple[Html, ...]) -> str:
    style = Html(files("calibrate.report").joinpath("report.css").read_text(encoding="utf-8"))
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("title", f"Joint zeros of {known.recording.rig.name}"),
        tag("style", style),
    )
    footer = tag("footer", f"Written by {known.result.software}. This file needs no network and no other file.")
    body = tag("body", tag("main", summary.masthead(known), _contents(), *chapters, footer))
    return join(Html("<!doctype html>\n"), tag("html", head, body, lang="en"), Html("\n"))


def _contents() -> Html:
    titles = {
        "rig": rig.TITLE,
        "spots": spots.TITLE,
        "centring": centring.TITLE,
        "residuals": residuals.TITLE,
        "zeros": zeros.TITLE,
        "point": point.TITLE,
        "unseen": unseen.TITLE,
        "provenance": provenance.TITLE,
    }
    return tag("nav", *(tag("a", title, href=f"#{anchor}") for anchor, title in titles.items()), aria_label="Contents")
