"""The chapter with every parameter, and the table of the arm: nominal, correction, calibrated.

A parameter has a number with its sigma, or the reason why there is none; rank stands before both. The table is in
degrees, mm and the robot's signs: a joint that the rig file declares with `sign = -1` was turned round when the file
was read, so its nominal numbers are those of the axis as the controller counts, and so are the corrections
(acquisition/recording/rig/senses.py).
"""

from collections.abc import Iterator

import numpy as np

from calibrate.apply.export import cells, nominal_table
from calibrate.fit.identify.session import holds_spots
from calibrate.fit.rank import WEAK, WELL_CONDITIONED, in_plain_words, kind_of, reason_among
from calibrate.model.default_tolerance import said_of
from calibrate.model.model_file import ModelFile, ModelParameter
from calibrate.model.parameters import Parameter
from calibrate.quantities import (
    DASH,
    aligned,
    decimals_of,
    fixed,
    significant,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    figure,
    folded,
    halves,
    join,
    panels,
    section,
    table,
    tag,
)
from calibrate.report.elements.svg import spectrum
from calibrate.report.evidence.session_evidence import SessionEvidence

TITLE = "What was identified, and what was not"
MOST_LISTED = 12  # parameters without a number: of more, one line a reason, the rest folded
LEARNED = 0.9  # sigma over drawing tolerance: above, these data taught nothing about the parameter


def parameters_chapter(evidence: SessionEvidence) -> Html:
    """Rank and unseen combinations, then numbers, then what has none."""
    model = evidence.model
    lead = f"{model.rank} of {model.free} combinations of parameters are determined (rank). Fit: {model.says}."
    lead += _unasked(evidence)
    known = [p for p in model.parameters if p.value is not None]
    refused = [p for p in model.parameters if p.value is None]
    content = [_rank(evidence), tag("h3", "Identified"), _numbers(evidence, known)]
    if refused:
        content += [tag("h3", "Not determined"), tag("p", _about_refusals(), cls="lead"), _refusals(evidence, refused)]
    return section("parameters", TITLE, lead, *content)


def _unasked(evidence: SessionEvidence) -> str:
    """What a fit to spots assumes of a rig that states no tolerance."""
    rig, samples = evidence.recording.rig, evidence.recording.samples
    said = said_of(rig) if holds_spots(samples) else None
    return "" if said is None else f" The rig file has {said}."


def _rank(evidence: SessionEvidence) -> Html:
    model = evidence.model
    s = np.array(model.singular_values)
    words = tag("div", tag("h3", "Combinations that are not determined"), *_combinations(evidence))
    if len(s) == 0:
        return words
    drawing = any(np.isfinite(p.prior) for p in evidence.parameters)
    caption = (
        "Singular values of the weighted Jacobian in plausible sizes: how many times better than by its plausible size "
        f"one combination of parameters is known. Below {WEAK:g} it is not determined."
    )
    return panels(figure(spectrum(s, model.rank, "spectrum", with_drawing=drawing), caption), words)


def _combinations(evidence: SessionEvidence) -> Iterator[Html]:
    model = evidence.model
    yield from _observability(model)
    if not model.unseen:
        yield tag("p", "Every parameter can be separated from every other.")
        return
    kinds = dict.fromkeys(kind_of(u) for u in model.unseen)
    for kind in kinds:
        yield tag("p", f"{kind[0].upper()}{kind[1:]}:")
        yield bullets(in_plain_words(u.words) for u in model.unseen if kind_of(u) == kind)


def _observability(model: ModelFile) -> Iterator[Html]:
    seen = model.observability
    if seen is None:
        if model.condition is not None:
            yield tag("p", f"Condition of what is determined: {significant(model.condition)}.")
        return
    values = (seen.o1, seen.o2, seen.o3, seen.o4, seen.o5, seen.condition)
    row = tuple(DASH if value is None else significant(value) for value in values)
    caption = f"Observability of the {seen.parameters} parameters that the data determine"
    head = (*(f"O{k}" for k in range(1, 6)), "condition")
    yield table(head, [row], numeric=range(6), caption=caption)
    if seen.condition is not None and seen.condition > WELL_CONDITIONED:
        says = f"Condition above {WELL_CONDITIONED:g}: other poses would determine some parameters far better."
        yield tag("p", says, cls="lead")


def _numbers(evidence: SessionEvidence, known: list[ModelParameter]) -> Html:
    if not known:
        return tag("p", "No single parameter is determined alone; together they predict (model.json: chain).")
    assumed = {p.name: p for p in evidence.parameters}
    drawn = any(p.bootstrap_sigma is not None for p in known)
    head = (
        "Parameter",
        "what it is",
        "correction",
        "± sigma",
        *(("by refits",) if drawn else ()),
        "unit",
        "known from",
    )
    numbers = [_number(p) for p in known]
    values, sigmas = (aligned(list(column)) for column in zip(*(n[:2] for n in numbers), strict=True))
    rows = [
        (tag("code", p.name), in_plain_words(p.name), value, sigma, *_by_refits(p, drawn), unit, _source(p, assumed))
        for p, value, sigma, (_, _, unit) in zip(known, values, sigmas, numbers, strict=True)
    ]
    return halves(table(head, rows, numeric=(2, 3, 4) if drawn else (2, 3)), terse=True)


def _number(found: ModelParameter) -> tuple[str, str, str]:
    """Correction, sigma and their unit."""
    scale, unit = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}.get(found.unit, (1.0, found.unit))
    value, sigma = scale * (found.value or 0.0), scale * (found.sigma or 0.0)
    digits = decimals_of(sigma)
    return fixed(value, digits), fixed(sigma, digits), unit


def _by_refits(found: ModelParameter, drawn: bool) -> tuple[str, ...]:
    if not drawn:
        return ()
    scale = {"m": 1e3, "rad": 1e3}.get(found.unit, 1.0)
    return (DASH,) if found.bootstrap_sigma is None else (significant(scale * found.bootstrap_sigma, 2),)


def _source(found: ModelParameter, assumed: dict[str, Parameter]) -> str:
    own = assumed.get(found.name)
    drawing = own is not None and (found.sigma or 0.0) > LEARNED * own.prior
    return "nominal" if drawing else "data"


def _about_refusals() -> str:
    return (
        "For each of these, many values fit the data equally well. Predictions are not affected: of each combination "
        "one parameter is held at its nominal value."
    )


def _refusals(evidence: SessionEvidence, refused: list[ModelParameter]) -> Html:
    rows = [
        (tag("code", p.name), in_plain_words(p.name), reason_among(p.name, evidence.model.unseen, p.undetermined))
        for p in refused
    ]
    listed = table(("Parameter", "what it is", "why there is no number"), rows)
    if len(rows) <= MOST_LISTED:
        return listed
    by_reason: dict[str, list[str]] = {}
    for (_, _, why), p in zip(rows, refused, strict=True):
        by_reason.setdefault(why, []).append(p.name)
    summed = [(f"{why[0].upper()}{why[1:]}", ", ".join(names)) for why, names in by_reason.items()]
    return join(
        table(("Why there is no number", "parameters"), summed),
        folded(f"All {len(rows)}, each with its reason", listed, on_paper=False),
    )


HEAD = ("nominal", "correction", "± sigma", "calibrated")
LEAD = (
    "Calibrated = nominal + correction, in the robot’s own signs: the true angle of a joint is its reading plus this "
    "offset. The calibrated values belong together; use all of them or none."
)


def table_part(evidence: SessionEvidence) -> Iterator[Html]:
    """The joints' offsets, and folded the links; nothing where the model has none of them."""
    rows = nominal_table(evidence.calibrated_arm)
    joints = [cells(row) for row in rows if "." not in row.parameter]
    links = [row for row in rows if "." in row.parameter]
    if not rows:
        return
    yield tag("h3", "Nominal, correction, calibrated")
    yield tag("p", LEAD, cls="lead")
    yield table(("Joint", *HEAD), joints, numeric=(1, 2, 3, 4))
    if links:
        left = sum(row.correction is None for row in links)
        title = f"D-H table: {len(links)} numbers" + (f", {left} of them not determined" if left else "")
        yield folded(title, halves(table(("Number", *HEAD), map(cells, links), numeric=(1, 2, 3, 4))))
