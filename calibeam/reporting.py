"""Which report a recording gets: that of joint zeros where the dual PSD is all there is, else that of the arm."""

from pathlib import Path

from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibeam.any_session import asks_for_zeros, identify_session
from calibeam.identification import Identified, identified_model, identify_recording
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.identification.evidence_record import evidence_fields
from calibrate.identification.record import record_of
from calibrate.model_file import ModelFile, RigIdentity
from calibrate.report.answers import Answers
from calibrate.report.drift.drift import Calibration, drift_of
from calibrate.report.evidence import evidence
from calibrate.report.page import write_page
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_report import session_answers, session_page
from calibrate.report.session_workspace import session_arm
from calibrate.report.zero_report import ZeroSession, zero_answers, zero_page
from calibrate.report.zero_workspace import zero_arm

ZEROS_ONLY = "joint_believed_rad"  # a noise that only the method for spots alone writes: not with a plan
SAME = 1e-3  # of the rms: what two machines may differ by
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
    if asks_for_zeros(recording.rig, recording.samples) and (model is None or ZEROS_ONLY in model.noise):
        identified = identify_recording(recording)
        if model is not None:
            _refuse_other(model, identified, recording)
        return _zero_report(identified, path, diagnosis, against, interactive=interactive)
    known = session_evidence(recording, _identified(recording) if model is None else model)
    drift = None
    if against is not None:
        drift = drift_of(Calibration(NOW, known.model, recording, diagnosis), against, session_arm(known))
    write_page(path, session_page(known, diagnosis, drift, interactive=interactive))
    return session_answers(known, drift)


def write_zero_report(identified: Identified, path: Path, diagnosis: DiagnosisFile | None = None) -> None:
    """The report of joint zeros, with the pages of a diagnosis where there is one."""
    _zero_report(identified, path, diagnosis, None, interactive=False)


def _zero_report(
    identified: Identified,
    path: Path,
    diagnosis: DiagnosisFile | None,
    against: Calibration | None,
    *,
    interactive: bool,
) -> Answers:
    proved = identified.proved
    session = ZeroSession(
        evidence(identified.used, identified.zeros, "reported"),
        identified.four_poses,
        left_out=tuple(blunder.says for blunder in identified.blunders),
        proved=None if proved is None else evidence_fields(proved.evidence),
        alarms=() if proved is None else proved.alarms,
    )
    drift = None
    if against is not None:
        now = Calibration(NOW, identified_model(identified, identified.used), identified.used, diagnosis)
        drift = drift_of(now, against, zero_arm(session.evidence, session.proved))
    write_page(path, zero_page(session, diagnosis, drift, interactive=interactive))
    return zero_answers(session, drift)


def _identified(recording: Recording) -> ModelFile:
    identity = RigIdentity(recording.rig.name, rig_sha256(recording.rig_text), recording.rig_text)
    return record_of(identify_session(recording), identity, recording.rig.arm.model.value)


def _refuse_other(model: ModelFile, identified: Identified, recording: Recording) -> None:
    zeros = identified.zeros
    same_names = set(model.chain) == {p.name for p in zeros.parameters}
    same_rms = abs(model.rms_after_m - zeros.rms_after_m) <= SAME * zeros.rms_after_m
    if not (same_names and same_rms and model.poses == zeros.n_poses):
        raise DataError(
            f"report: the model ({model.poses} poses, {1e6 * model.rms_after_m:.4g} um rms) is not what "
            f"{recording.path.name} gives ({zeros.n_poses} poses, {1e6 * zeros.rms_after_m:.4g} um rms); "
            "give the model of this recording, or identify it again"
        )
