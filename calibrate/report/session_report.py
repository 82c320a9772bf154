"""Writes the report of any session: positions, wire, cones, bars, poses, spots, alone or together."""

from pathlib import Path

from acquisition.recording.recording import Recording
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.model_file import ModelFile
from calibrate.report.diagnosis.page import inserted
from calibrate.report.page import page, write_page
from calibrate.report.sections import arm_data, arm_errors, arm_parameters, arm_proofs, arm_summary, provenance
from calibrate.report.session_evidence import session_evidence

CONTENTS = {
    "errors": arm_errors.TITLE,
    "proofs": arm_proofs.TITLE,
    "parameters": arm_parameters.TITLE,
    "data": arm_data.TITLE,
    "provenance": provenance.TITLE,
}


def write_session_report(
    path: Path | str, recording: Recording, model: ModelFile, diagnosis: DiagnosisFile | None = None
) -> Path:
    """One HTML file at `path`, over what may be there; returns it. `diagnosis` adds its pages.

    DataError where the model was not made from this recording, or the file cannot be written.
    """
    return write_page(path, session_report_html(recording, model, diagnosis))


def session_report_html(recording: Recording, model: ModelFile, diagnosis: DiagnosisFile | None = None) -> str:
    """The page as text."""
    known = session_evidence(recording, model)
    chapters = (
        arm_summary.summary(known),
        arm_errors.errors_chapter(known),
        arm_proofs.proofs_chapter(known),
        arm_parameters.parameters_chapter(known),
        arm_data.data_chapter(known),
        provenance.provenance(recording, model.poses, "took part in the fit", model.software),
    )
    contents, chapters = inserted(CONTENTS, chapters, diagnosis, recording.rig)
    return page(f"The arm {recording.rig.name}", arm_summary.masthead(known), contents, chapters, model.software)
