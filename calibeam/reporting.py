"""Which report a recording gets: that of joint zeros where the dual PSD is all there is, else that of the arm."""

from pathlib import Path

from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from calibeam.any_session import asks_for_zeros, identify_session
from calibeam.identification import Identified, identify_recording
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.identification.evidence_record import evidence_fields
from calibrate.identification.record import record_of
from calibrate.model_file import ModelFile, RigIdentity
from calibrate.report.session_report import write_session_report
from calibrate.report.zero_report import write_report

ZEROS_ONLY = "joint_believed_rad"  # a noise that only the method for spots alone writes: not with a plan
SAME = 1e-3  # of the rms: what two machines may differ by


def write_any_report(
    recording: Recording, model: ModelFile | None, path: Path, diagnosis: DiagnosisFile | None = None
) -> None:
    """The report at `path`; without a model the recording is identified anew, without a plan. A diagnosis adds pages.

    DataError where the recording holds nothing to fit, the model is not of it, or the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if asks_for_zeros(recording.rig, recording.samples) and (model is None or ZEROS_ONLY in model.noise):
        identified = identify_recording(recording)
        if model is not None:
            _refuse_other(model, identified, recording)
        write_zero_report(identified, path, diagnosis)
    else:
        write_session_report(path, recording, _identified(recording) if model is None else model, diagnosis)


def write_zero_report(identified: Identified, path: Path, diagnosis: DiagnosisFile | None = None) -> None:
    """The report of joint zeros, with the pages of a diagnosis where there is one."""
    write_report(
        path,
        identified.used,
        identified.zeros,
        point_constraint=identified.four_poses,
        left_out=[blunder.says for blunder in identified.blunders],
        proved=None if identified.proved is None else evidence_fields(identified.proved.evidence),
        alarms=() if identified.proved is None else identified.proved.alarms,
        diagnosis=diagnosis,
    )


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
