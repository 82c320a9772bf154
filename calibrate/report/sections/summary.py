"""The first page of a session's report: verdict, what to do, figures, joint zeros; and the lines of a certificate.

A certificate names the robot, person, place and instruments; in print, blank lines stand for what is absent.
"""

import numpy as np

from acquisition.recording import Recording
from acquisition.recording.rig.schema import SiteInstrument
from calibrate.diagnose.record.schema import DiagnosisFile
from calibrate.model.model_file import WorkspaceErrorRecord
from calibrate.model.sensors.catalogue import kind_of
from calibrate.quantities import DASH, length, significant
from calibrate.report.elements.html import (
    Html,
    figure,
    section,
    tag,
)
from calibrate.report.elements.verdict import Answers, Number, first_screen
from calibrate.report.evidence.model_tests import proofs
from calibrate.report.evidence.session_evidence import Readings, SessionEvidence
from calibrate.report.evidence.session_verdict import session_verdict
from calibrate.report.sections.parameter_tables import table_part
from calibrate.report.sections.zeros import determined, limits_of_zeros
from calibrate.report.workspace.pictures import tool_maps
from calibrate.report.workspace.workspace_errors import Room, limit_of, tool_numbers

TITLE = "Certificate"
LEAD = "From [site] of the rig file, as recorded. What is absent there is a blank line in print."
MAKES = {
    "abb": "ABB",
    "fanuc": "FANUC",
    "franka": "Franka",
    "kuka": "KUKA",
    "staubli": "Stäubli",
    "ur": "Universal Robots",
}
BLANK_INSTRUMENTS = 2  # lines for instruments where the rig file names none
SIGNED = ("Place, date", "Calibrated by", "Checked by")


def certificate(recording: Recording) -> Html:
    """Facts, instruments, signatures; on a screen only where the rig file states any of it."""
    rig, site = recording.rig, recording.rig.site
    make = None if rig.arm.make is None else MAKES.get(rig.arm.make.value, rig.arm.make.value.capitalize())
    pairs = (
        ("Robot", site.robot or make),
        ("Serial number", rig.arm.serial_number),
        ("Site", site.place),
        ("Operator", site.operator),
        ("Measured (UTC)", when(recording) or None),
    )
    known = bool(site.robot or site.place or site.operator or site.instruments or rig.arm.serial_number)
    facts = tag("dl", *(part for name, value in pairs for part in (tag("dt", name), tag("dd", _or_blank(value)))))
    signatures = tag("div", *(tag("div", _blank(), tag("span", name)) for name in SIGNED), cls="signatures")
    content = section(
        "certificate", TITLE, LEAD, tag("div", facts, _instruments(site.instruments), cls="panels"), signatures
    )
    return content if known else tag("div", content, cls="print-only")


def when(recording: Recording) -> str:
    """Start of the session to the second, UTC; empty where it is not known."""
    return recording.started_utc.partition(".")[0].partition("+")[0].replace("T", " ")


def _instruments(listed: tuple[SiteInstrument, ...]) -> Html:
    head = ("Instrument", "serial number", "calibrated", "certificate")
    rows = [
        (i.name, i.serial_number, None if i.calibrated is None else i.calibrated.isoformat(), i.certificate)
        for i in listed
    ] or [(None,) * len(head)] * BLANK_INSTRUMENTS
    body = (tag("tr", *(tag("td", _or_blank(value), cls="t") for value in row)) for row in rows)
    top = tag("thead", tag("tr", *(tag("th", text, scope="col", cls="t") for text in head)))
    return tag("div", tag("table", top, tag("tbody", *body)), cls="scroll")


def _or_blank(value: str | None) -> str:
    return _blank() if value is None else value


def _blank() -> Html:
    """A line to write on."""
    return tag("span", cls="blank")


ANYWHERE = "Between the joint limits"
MOSTLY = 0.9  # of the error of a single pose, by the uncertainty of the parameters: the rest adds in quadrature


def masthead(evidence: SessionEvidence) -> Html:
    """Title, when and with what."""
    recording, model = evidence.recording, evidence.model
    seen = ", ".join(kind_of(name).title for name in model.instruments)
    said = [f"{when(recording)} UTC"] if when(recording) else []
    said += [f"{model.poses} samples", seen, model.software]
    return tag(
        "header",
        tag("p", "Identification of an arm", cls="kicker"),
        tag("h1", recording.rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )


def summary(said: Answers, evidence: SessionEvidence, room: Room | str) -> Html:
    """What a person must know before anything else; `room` of session_room."""
    maps = None if isinstance(room, str) else figure(tool_maps(room), MAPS)
    return tag("div", first_screen(said, maps), *table_part(evidence), certificate(evidence.recording), id="summary")


def answers(evidence: SessionEvidence, room: Room | str, diagnosis: DiagnosisFile | None = None) -> Answers:
    """How good, whether to trust it, what to do; first of all the error of the tool over the workspace."""
    model, first = evidence.model, evidence.readings[0]
    known = sum(p.value is not None for p in model.parameters)
    rest = ", the others only in combinations" if known < len(model.parameters) else ""
    limits = tuple(limits_of_zeros(evidence))
    also = (
        f"{model.poses} samples used of {len(evidence.recording.samples)}; {evidence.left_out} left out as faulty",
        f"{known} of {len(model.parameters)} parameters determined{rest}",
        *([determined(evidence)] if limits else []),
        f"rows of the fit: {first.says(_rms(first.error_after))} rms distance",
    )
    numbers = (*tool_numbers(room, diagnosis), *_errors(evidence), _anywhere(model.free_space))
    return Answers(session_verdict(evidence, diagnosis), numbers, limits, limit_of(room), also)


MAPS = (
    "From the side, one scale for both. Hatched: not covered by the calibration poses; circles: poses of the session."
)


def _errors(evidence: SessionEvidence) -> tuple[Number, Number]:
    """Nominal and now: on unseen rows where there are any, else on those of the fit."""
    first, proof = evidence.readings[0], next(iter(proofs(evidence.model)), None)
    if proof is None:
        before, after = _rms(first.error_before), _rms(first.error_after)
        which, on = "Fitted readings", f"rms distance of {_what(first)}, those of the fit itself"
    else:
        before, after = proof.rms_distance_before_m, proof.rms_distance_after_m
        which = "Unseen readings"
        on = f"rms distance of {proof.observations} {_what(first)} that the fit has not seen"
    gain = f"; {significant(before / after)} times smaller" if after > 0.0 else ""
    return (
        Number("as_drawn", f"{which}, nominal", before, first.unit, first.says(before), f"{on}; nominal arm"),
        Number("now", f"{which}, calibrated", after, first.unit, first.says(after), on + gain),
    )


def _what(readings: Readings) -> str:
    return readings.title[0].lower() + readings.title[1:]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _anywhere(room: WorkspaceErrorRecord | None) -> Number:
    """What 95 % of all poses between the joint limits stay below, one sigma, as predicted; or why there is none."""
    if room is None or room.pose_p95_m is None:
        why = "not predicted" if room is None else f"not determined: {room.says}"
        return Number("anywhere", ANYWHERE, None, "m", DASH, why)
    about = "tool error, one sigma of a single pose, of 95 % of all poses; predicted, if the model is right"
    if room.p95_m is not None and room.p95_m > MOSTLY * room.pose_p95_m:
        about += "; nearly all of it is geometry that these readings do not determine"
    return Number("anywhere", ANYWHERE, room.pose_p95_m, "m", length(room.pose_p95_m), about)
