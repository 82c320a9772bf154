"""Writes the report of a dual-PSD session: one HTML file that needs nothing else, on a screen, a phone or on paper."""

from collections.abc import Sequence
from pathlib import Path

from acquisition.recording.recording import Recording
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.identification.evidence_record import EvidenceFields
from calibrate.read_samples import Angles
from calibrate.report.diagnosis.page import inserted
from calibrate.report.evidence import evidence
from calibrate.report.page import page, write_page
from calibrate.report.sections import (
    centring,
    point,
    proofs,
    provenance,
    residuals,
    rig,
    spots,
    summary,
    unseen,
    zeros,
)
from calibrate.zeros.point_constraint import PointConstraintResult
from calibrate.zeros.result import ZeroResult

CONTENTS = {
    "rig": rig.TITLE,
    "spots": spots.TITLE,
    "centring": centring.TITLE,
    "residuals": residuals.TITLE,
    "zeros": zeros.TITLE,
    "point": point.TITLE,
    "proofs": proofs.TITLE,
    "unseen": unseen.TITLE,
    "provenance": provenance.TITLE,
}


def write_report(
    path: Path | str,
    recording: Recording,
    result: ZeroResult,
    *,
    point_constraint: PointConstraintResult | None = None,
    why_no_point_constraint: str = "it was not asked for",
    angles: Angles = "reported",
    left_out: Sequence[str] = (),
    proved: EvidenceFields | None = None,
    alarms: Sequence[str] = (),
    diagnosis: DiagnosisFile | None = None,
) -> Path:
    """One HTML file at `path`, over what may be there; returns it.

    `left_out` are sentences, each naming rows that were recorded but not fitted; `proved` is None where nothing was;
    `alarms` are what to read before the numbers;
    `diagnosis` adds its pages.
    `result` must come from `recording` with these `angles`. DataError if it does not, or the file cannot be written.
    """
    text = report_html(
        recording,
        result,
        point_constraint=point_constraint,
        why_no_point_constraint=why_no_point_constraint,
        angles=angles,
        left_out=left_out,
        proved=proved,
        alarms=alarms,
        diagnosis=diagnosis,
    )
    return write_page(path, text)


def report_html(
    recording: Recording,
    result: ZeroResult,
    *,
    point_constraint: PointConstraintResult | None = None,
    why_no_point_constraint: str = "it was not asked for",
    angles: Angles = "reported",
    left_out: Sequence[str] = (),
    proved: EvidenceFields | None = None,
    alarms: Sequence[str] = (),
    diagnosis: DiagnosisFile | None = None,
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
        *([] if proved is None else [proofs.proofs(proved, alarms)]),
        unseen.unseen(known, left_out),
        provenance.provenance(recording, result.n_poses, "with both spots", f"{result.software}, {result.steps} steps"),
    )
    contents = {anchor: title for anchor, title in CONTENTS.items() if anchor != "proofs" or proved is not None}
    contents, chapters = inserted(contents, chapters, diagnosis, recording.rig)
    return page(f"Joint zeros of {recording.rig.name}", summary.masthead(known), contents, chapters, result.software)
