"""The chapter that compares a calibration with an earlier one of the same arm."""

from math import degrees

import numpy as np

from calibrate.report.drift.parameters import FAMILY, Change, Compared
from calibrate.report.drift.then_and_now import both, findings
from calibrate.report.drift.two_calibrations import Drift
from calibrate.report.drift.words import sentence
from calibrate.report.elements import Html, bullets, figure, folded, section, table, tag
from calibrate.report.not_determined import in_plain_words
from calibrate.report.quantities import aligned, decimals_of, fixed, length, significant
from calibrate.report.verdict import coded
from calibrate.report.workspace.pictures import Layer, pictures
from calibrate.report.workspace.sections import VIEWS, grid_of

TITLE = "What has changed"
BEYOND_DOUBT = 2.0  # sigma of the change of the tool, below which a cell is not drawn


def drift_chapter(drift: Drift) -> Html:
    """Sentence, picture, parameters, both calibrations side by side."""
    lead = f"This calibration against {drift.then.label}, of the arm itself: base, target and fixture may have moved."
    content = [tag("p", tag("b", sentence(drift)))]
    if drift.warnings:
        content.insert(0, tag("div", bullets(coded(w) for w in drift.warnings), cls="verdict care"))
    return section(
        "drift", TITLE, lead, *content, *_picture(drift), *_parameters(drift.compared), both(drift), findings(drift)
    )


def _picture(drift: Drift) -> list[Html]:
    room, tool = drift.room, drift.tool
    if room is None or tool is None:
        return [tag("p", "The effect on the tool is not drawn: the error over the workspace cannot be determined.")]
    if not drift.found:
        doubt = length(float(np.sqrt(np.mean(tool.sigma_m[room.supported] ** 2))), 2)
        return [tag("p", f"No change of the tool is drawn: none is beyond chance (uncertainty {doubt}, one sigma).")]
    grids = tuple(grid_of(view, room.reach_m) for view in VIEWS)
    clear = room.supported & (tool.moved_m > BEYOND_DOUBT * tool.sigma_m)
    cells = tuple(grid.rms(room.points_m, tool.moved_m, clear) for grid in grids)
    says = "how far the tool has moved since over the workspace, from the side and from above"
    drawing = pictures(
        "drift-workspace", says, room, grids, {"change": [Layer("then to now", cells)]}, "change of the tool"
    )
    caption = (
        f"How far the tool is now from where it was at the same joint readings, base and tool being the same: up to "
        f"{length(tool.largest_m, 2)} ± {length(tool.largest_sigma_m, 2)}. Only parameters that both determine are "
        "changed. Hatched: not supported by the poses of now, or less than two sigma of the change."
    )
    return [tag("div", figure(drawing, caption), cls="wide")]


def _parameters(found: Compared) -> list[Html]:
    if not found.changes:
        return [tag("p", "No parameter of the arm is determined by both.")]
    numbers = [_number(change) for change in found.changes]
    values, sigmas = (aligned([n[k] for n in numbers]) for k in (0, 1))
    rows = [
        (
            tag("code", c.name),
            in_plain_words(c.name),
            value,
            sigma,
            unit,
            fixed(c.sigmas, 1),
            tag("b", "changed") if c.significant else "as chance gives",
        )
        for c, value, sigma, (_, _, unit) in zip(found.changes, values, sigmas, numbers, strict=True)
    ]
    head = ("Parameter", "what it is", "change", "± sigma", "unit", "sigmas", "reads as")
    out = [tag("h3", "Parameters"), tag("p", _law(found), cls="lead"), table(head, rows, numeric=(2, 3, 5))]
    if found.left_out:
        listed = table(("Parameter", "why it is not compared"), ((tag("code", n), why) for n, why in found.left_out))
        out.append(folded(f"{len(found.left_out)} parameters of the arm that are not compared", listed))
    return out


def _law(found: Compared) -> str:
    said = (
        f"{len(found.changes)} parameters are compared, so a change counts from {fixed(found.limit_sigmas, 1)} sigma "
        f"on: in {1.0 - FAMILY:.0%} of all comparisons of an unchanged arm none is that large. Sigma is of both "
        "calibrations together."
    )
    if found.together is None:
        return said
    p = significant(found.together.p, 2) if found.together.p > 0.0 else "0"
    return f"{said} All together: chi² = {significant(found.together.chi2)} of {found.together.dof}, p = {p}."


def _number(change: Change) -> tuple[str, str, str]:
    """Change, sigma and their unit."""
    value, sigma, unit = 1e3 * change.change, 1e3 * change.sigma, "mm"
    if change.unit == "rad":
        value, sigma, unit = degrees(change.change), degrees(change.sigma), "°"
    elif change.unit != "m":
        value, sigma, unit = change.change, change.sigma, change.unit
    digits = decimals_of(sigma)
    return fixed(value, digits), fixed(sigma, digits), unit
