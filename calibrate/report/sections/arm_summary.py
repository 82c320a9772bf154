"""The first page of a session's report: verdict, what to do, figures, joint zeros."""

from math import degrees

import numpy as np

from calibrate.model_file import ModelParameter
from calibrate.report.elements import Html, bullets, figure, panels, table, tag
from calibrate.report.error_figures import by_sample, errors
from calibrate.report.model_tests import proofs
from calibrate.report.quantities import aligned, decimals_of, fixed, significant
from calibrate.report.reasons import reason_among
from calibrate.report.session_evidence import SAID, Readings, SessionEvidence
from calibrate.report.session_verdict import session_verdict
from calibrate.report.tiles import tile


def masthead(evidence: SessionEvidence) -> Html:
    """Title, when and with what."""
    recording, model = evidence.recording, evidence.model
    when = recording.started_utc.partition(".")[0].replace("T", " ")
    seen = ", ".join(SAID.get(name, name).lower() for name in model.instruments)
    said = [f"{when} UTC"] if when else []
    said += [f"{model.poses} samples", seen, model.software]
    return tag(
        "header",
        tag("p", "Identification of an arm", cls="kicker"),
        tag("h1", recording.rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )


def summary(evidence: SessionEvidence) -> Html:
    """What a person must know before anything else."""
    first = evidence.readings[0]
    pictures = panels(
        figure(errors(first), "Every reading, before and after, on a logarithmic axis."),
        figure(by_sample(first), "The same in the order of the file: a drift or a knock would show here."),
    )
    return tag("div", _verdict(evidence), _tiles(evidence), pictures, *_zeros(evidence), id="summary")


def _verdict(evidence: SessionEvidence) -> Html:
    judged = session_verdict(evidence)
    content = [tag("strong", judged.sentence)]
    if judged.reasons:
        content.append(bullets(judged.reasons))
    if judged.advice:
        content += [tag("p", tag("b", "What to do")), bullets(judged.advice)]
    return tag("div", *content, cls=f"verdict {judged.trust.value}")


def _tiles(evidence: SessionEvidence) -> Html:
    model, first = evidence.model, evidence.readings[0]
    before, after = (_rms(values) for values in (first.error_before, first.error_after))
    tiles = [
        tile("As drawn", first.says(before), f"rms of {_what(first)}, arm and frames where they fit best"),
        tile("Identified", first.says(after), f"rms, {significant(before / after)} times better" if after else "rms"),
    ]
    tiles += [
        tile("Unseen rows", first.says(p.rms_after), f"rms on {p.observations} readings: {p.split}")
        for p in proofs(model)[:1]
    ]
    known = sum(p.value is not None for p in model.parameters)
    tiles.append(tile("Parameters told", f"{known} of {len(model.parameters)}", "the others only in combinations"))
    used = f"of {len(evidence.recording.samples)}; {evidence.left_out} left out as faulty"
    tiles.append(tile("Samples used", str(model.poses), used))
    return tag("div", *tiles, cls="tiles")


def _what(readings: Readings) -> str:
    return readings.title[0].lower() + readings.title[1:]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _zeros(evidence: SessionEvidence) -> list[Html]:
    """Value and sigma in degrees, one line a joint; none where the arm's zeros were no unknowns."""
    zeros = [p for p in evidence.model.parameters if p.name.startswith("joint") and p.name.endswith(".zero")]
    if not zeros:
        return []
    known = [(p, degrees(p.value), degrees(p.sigma)) for p in zeros if p.value is not None and p.sigma is not None]
    values = aligned([fixed(value, decimals_of(sigma)) for _, value, sigma in known])
    sigmas = aligned([fixed(sigma, decimals_of(sigma)) for _, _, sigma in known])
    micro = aligned([significant(1e6 * (p.sigma or 0.0), 2) for p, _, _ in known])
    numbers = {p.name: row for (p, _, _), *row in zip(known, values, sigmas, micro, strict=True)}
    rows = [_zero(p, numbers.get(p.name), evidence) for p in zeros]
    head = ("Joint", "zero (°)", "± sigma (°)", "± sigma (µrad)")
    lead = "True joint angle = reading + zero. Sigma is one standard deviation. All other parameters are further down."
    return [tag("h3", "Joint zeros"), tag("p", lead, cls="lead"), table(head, rows, numeric=(1, 2, 3))]


def _zero(zero: ModelParameter, numbers: list[str] | None, evidence: SessionEvidence) -> tuple[str, ...]:
    joint = f"J{zero.name.removeprefix('joint').removesuffix('.zero')}"
    if numbers is None:
        return joint, f"not determined: {reason_among(zero.name, evidence.model.unseen, zero.undetermined)}"
    return (joint, *numbers)
