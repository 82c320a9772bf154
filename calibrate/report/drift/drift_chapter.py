"""The chapter that compares a calibration with an earlier one of the same arm: its sentence, its tables, its maps."""

from collections.abc import Iterator
from math import degrees

import numpy as np

from calibrate.diagnose.record.schema import DiagnosisFile, FindingRecord
from calibrate.fit.rank import in_plain_words
from calibrate.model.model_file import ModelFile
from calibrate.quantities import (
    DASH,
    aligned,
    angle,
    counted,
    decimals_of,
    fixed,
    length,
    significant,
)
from calibrate.report.drift.two_calibrations import (
    FAMILY,
    Calibration,
    Change,
    Compared,
    Drift,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    folded,
    section,
    table,
    tag,
)
from calibrate.report.elements.verdict import coded
from calibrate.report.evidence.model_tests import proofs
from calibrate.report.workspace.cells import VIEWS, grid_of
from calibrate.report.workspace.pictures import Layer, pictures

IN_SENTENCE = 3  # changes in the sentence; all of them stand in the table


def sentence(drift: Drift) -> str:
    """What moved since, by how much and how surely, and what it does to the tool."""
    since, found = f"Since {drift.then.label}", drift.compared
    if not found.changes:
        return f"{since}: no comparison, because no parameter of the arm is determined both then and now."
    if not drift.found:
        largest = max(found.changes, key=lambda c: c.sigmas)
        most = f" (most of all {in_plain_words(largest.name)}, {significant(largest.sigmas, 2)} sigma)"
        return (
            f"{since}: no drift shows. None of {len(found.changes)} parameters changed by more than chance gives"
            f"{most if largest.sigmas > 0.0 else ''}{_blind(drift)}."
        )
    clear = found.significant
    sentences = [moved(change) for change in clear[:IN_SENTENCE]]
    if len(clear) > IN_SENTENCE:
        more = len(clear) - IN_SENTENCE
        sentences.append(f"{counted(more, 'more parameter')} changed")
    if not sentences and found.together is not None:
        sentences = [f"the arm changed, but no single parameter shows where (p = {significant(found.together.p, 2)})"]
    return f"{since}: {', '.join(sentences)}{_tool(drift)}."


def moved(change: Change) -> str:
    """'joint 3 moved by 0.021° (7 sigma)'."""
    owner, _, what = change.name.partition(".")
    times = f"({significant(change.sigmas, 2)} sigma)"
    if what == "zero":
        return f"joint {owner.removeprefix('joint')} moved by {size(change)} {times}"
    return f"{in_plain_words(change.name)} changed by {size(change)} {times}"


def size(change: Change) -> str:
    """Degrees for angles, a fitting unit for lengths, with the digits that the uncertainty leaves."""
    if change.unit == "rad":
        return f"{fixed(abs(degrees(change.change)), decimals_of(degrees(change.sigma)))}°"
    return length(abs(change.change))


def _blind(drift: Drift) -> str:
    """How much of a change would not have been seen."""
    if drift.tool is None or drift.room is None:
        return ""
    sigma_m = float(np.sqrt(np.mean(drift.tool.sigma_m[drift.room.supported] ** 2)))
    return f"; a change of the tool is determined to {length(sigma_m, 2)}, one sigma"


def _tool(drift: Drift) -> str:
    return "" if drift.tool is None else f"; tool error up to {length(drift.tool.largest_m, 2)}"


ANGULAR = ("joint", "orientation", "joint_rad")
ASSUMED_SUFFIX = "_believed"


def both(drift: Drift) -> Html:
    """Coverage, noise and proofs."""
    now, then = dict(_rows(drift.now)), dict(_rows(drift.then))
    names = dict.fromkeys((*now, *then))
    rows = [(name, then.get(name, DASH), now.get(name, DASH)) for name in names]
    return table(("", drift.then.label, "now"), rows, numeric=(1, 2), caption="Coverage, noise and proof, then and now")


def findings(drift: Drift) -> Html:
    """Causes that a diagnosis named then and now."""
    then, now = drift.then.diagnosis, drift.now.diagnosis
    missing = [label for label, file in (("then", then), ("now", now)) if file is None]
    if then is None or now is None:
        why = f"there is no diagnosis of {' and of '.join(missing)} here"
        return tag("p", f"Findings of a diagnosis are not compared: {why}.")
    keys = dict.fromkeys((*_by_cause(then), *_by_cause(now)))
    if not keys:
        return tag("p", "No diagnosis, neither then nor now, found physics that the model lacks.")
    rows = [(_state(k, then, now), _says(k, then), _says(k, now)) for k in keys]
    return table(("Finding", drift.then.label, "now"), rows, caption="What diagnoses found that geometry lacks")


def _rows(one: Calibration) -> Iterator[tuple[str, str]]:
    model = one.model
    yield "samples", str(model.poses)
    yield from _ranges(one)
    yield "combinations seen", f"{model.rank} of {model.free}"
    if model.observability is not None:
        yield "observability O1", significant(model.observability.o1)
    yield from _noise(model)
    for proof in proofs(model)[:1]:
        yield f"unseen {proof.instrument} readings, rms distance", length(proof.rms_distance_after_m)
    if model.free_space is not None and model.free_space.pose_p95_m is not None:
        yield "tool error over the workspace, 95 %, predicted", length(model.free_space.pose_p95_m)
    yield "software", model.software


def _ranges(one: Calibration) -> Iterator[tuple[str, str]]:
    """What the joints went through; a model alone does not show it."""
    if one.recording is None or len(one.recording.samples) == 0:
        return
    spans = np.degrees(np.ptp(one.recording.samples.joints(), axis=0))
    yield "joints went through", ", ".join(f"{fixed(float(s), 0)}°" for s in spans)


def _noise(model: ModelFile) -> Iterator[tuple[str, str]]:
    for name in (n for n in model.noise if n.endswith(ASSUMED_SUFFIX)):
        source = name.removesuffix(ASSUMED_SUFFIX)
        found = model.noise.get(source)
        if isinstance(found, float):
            yield f"noise of {source}", angle(found) if source in ANGULAR else length(found)
    for source, says in (("joint_rad", angle), ("psd_m", length)):  # of the method for spots alone
        found = model.noise.get(source)
        if isinstance(found, float):
            yield f"noise of {source.partition('_')[0]}", says(found)


def _by_cause(file: DiagnosisFile) -> dict[tuple[str, str], FindingRecord]:
    return {(f.where, f.physics): f for f in file.findings}


def _says(key: tuple[str, str], file: DiagnosisFile) -> str:
    finding = _by_cause(file).get(key)
    return DASH if finding is None else finding.says


def _state(key: tuple[str, str], then: DiagnosisFile, now: DiagnosisFile) -> str:
    if key not in _by_cause(then):
        return "new"
    return "in both" if key in _by_cause(now) else "gone"


TITLE = "What has changed"
SIGNIFICANT_SIGMAS = 2.0  # sigma of the change of the tool, below which a cell is not drawn


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
        sigma = length(float(np.sqrt(np.mean(tool.sigma_m[room.supported] ** 2))), 2)
        return [tag("p", f"No change of the tool is drawn: none is beyond chance (uncertainty {sigma}, one sigma).")]
    grids = tuple(grid_of(view, room.reach_m) for view in VIEWS)
    clear = room.supported & (tool.moved_m > SIGNIFICANT_SIGMAS * tool.sigma_m)
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
