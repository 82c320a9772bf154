"""The report of a recording, with its diagnosis and an earlier calibration where there are any."""

from pathlib import Path

from acquisition.recording import Recording
from calibeam.any_session import identify_session, session_model
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.model_file import ModelFile
from calibrate.report.answers import Answers
from calibrate.report.drift.drift import Calibration, drift_of
from calibrate.report.page import write_page
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_report import session_answers, session_page
from calibrate.report.session_workspace import session_arm

NOW = "now"


def write_any_report(
    recording: Recording,
    model: ModelFile | None,
    path: Path,
    diagnosis: DiagnosisFile | None = None,
    *,
    against: Calibration | None = None,
    interactive: bool = False,
) -> Answers:
    """The report at `path`; without a model the recording is identified anew, without a plan. Returns its first screen.

    A diagnosis adds pages, an earlier calibration of the same arm (`against`) a chapter on what has changed since,
    `interactive` figures that can be turned. DataError where the recording holds nothing to fit, the model is not of
    it, the other calibration cannot be compared, or the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    found = session_model(identify_session(recording), recording) if model is None else model
    known = session_evidence(recording, found)
    drift = None
    if against is not None:
        drift = drift_of(Calibration(NOW, known.model, recording, diagnosis), against, session_arm(known))
    write_page(path, session_page(known, diagnosis, drift, interactive=interactive))
    return session_answers(known, drift)
