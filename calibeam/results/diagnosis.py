"""From a recording to diagnosis.json: where it disagrees with the model, and why."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Recording, check
from acquisition.recording.examination import ExaminationRecord
from acquisition.recording.motion_plan import no_torque
from acquisition.recording.pose_plan import write_pose_plan
from acquisition.recording.recording_examinations import READINGS, reading_examinations
from acquisition.recording.rig import Rig, rig_sha256
from calibeam.results.controller_findings import CONTROLLER_ARM, controller_notes, with_controller
from calibeam.software import SOFTWARE
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.from_recording import Diagnosed, diagnose_samples
from calibrate.diagnose.motion import (
    TorqueDiagnosis,
    diagnose_torques,
    model_of_motion,
    torques_of_model,
    with_torques,
)
from calibrate.diagnose.new_poses import plan_of, separating
from calibrate.diagnose.record.file import write_diagnosis
from calibrate.diagnose.record.pose_examinations import POSE_EXAMINATIONS, REPORT, pose_examinations
from calibrate.diagnose.record.schema import (
    SCHEMA,
    TORQUES_IN_MOTION,
    DiagnosisFile,
    IncompleteRecord,
    RigRecord,
    no_better_with_physics,
)
from calibrate.diagnose.record.to_file import file_of
from calibrate.diagnose.stages import Stage, Stages
from calibrate.diagnose.streams import STREAM_EXAMINATIONS, streams_of, with_streams
from calibrate.diagnose.with_model import known_before, model_of_diagnosis, only_new, with_known_model
from calibrate.errors import DataError
from calibrate.model.model_file import ModelFile, read_model
from calibrate.model.sensors.catalogue import unused_columns

CURRENT = "actual_current_a"  # channel of a controller that reports no torques
SEED = 1  # of nulls, splits and bootstraps: the same recording always gives the same diagnosis


Keep = Callable[[DiagnosisFile], None]

DIAGNOSE_EXAMINATIONS = (
    *(one for one, _ in (*POSE_EXAMINATIONS, *STREAM_EXAMINATIONS)),
    READINGS,
    TORQUES_IN_MOTION,
    CONTROLLER_ARM,
)
NEXT_OF_AN_ARM = "record settled samples: streams alone show clocks, lags and faults, nothing of the geometry"
NEXT_OF_ENCODERS = (
    "`calibeam check LOG` shows pace, eccentricity, slips and noise of the encoders; `calibeam compare ONE TWO` "
    "compares two logs of the same motion"
)


def diagnose_recording(
    recording: Recording,
    model: ModelFile | None = None,
    keep: Keep | None = None,
    begun: Callable[[Stage], None] | None = None,
) -> tuple[Diagnosed, DiagnosisFile]:
    """Both as records and as the file states it; with a `model` only what is new to it.

    `keep` is called once with what is known as soon as the causes are: sizes, alternatives and proofs take a while.
    `begun` is called with each stage as it begins.
    DataError where the recording holds too little, or the model is of another rig.
    """
    _refuse_other_rig(recording, model)
    found, file = _diagnosed(recording, model, keep, begun)
    notes = (*unused_columns(recording.samples), *controller_notes(recording))
    return found, msgspec.structs.replace(file, next=(*file.next, *notes))


def _refuse_other_rig(recording: Recording, model: ModelFile | None) -> None:
    if model is not None and model.rig.sha256 != rig_sha256(recording.rig_text):
        raise DataError(
            f"the model is of rig '{model.rig.name}', whose file is another than that of {recording.path.name}; "
            "give the model that was identified with this rig, or none"
        )


def diagnose_streams(
    recording: Recording, model: ModelFile | None = None
) -> tuple[TorqueDiagnosis | None, DiagnosisFile]:
    """What the streams of a recording without samples show: their clocks, lags and faults, and torques in motion;
    nothing of the geometry. With a `model` only torques that are new to it.

    DataError where the streams are none that a finder knows, or the model is of another rig.
    """
    _refuse_other_rig(recording, model)
    report = streams_of(recording, None)
    if report is None:
        known = "joints, commands, a second set of encoders or spots"
        raise DataError(
            f"{recording.path}: no samples, and no stream of {known}; import the log with its columns stated: "
            '--columns "A1..A6 [deg] = q"'
        )
    nothing = without_samples(recording.rig, recording.rig_text)
    torques = _torques_of(recording, model)
    file = _with_readings(with_streams(nothing, report), recording)
    file = with_controller(with_torques(file, torques), recording) if recording.rig.n_joints else file
    if file.torques is not None:
        file = msgspec.structs.replace(file, next=tuple(one for one in file.next if one not in nothing.next))
    elif no_torque(recording.rig) and any(CURRENT in stream.values for stream in recording.streams.values()):
        file = msgspec.structs.replace(file, next=(*file.next, no_torque(recording.rig)))
    agree = file.verdict == Verdict.CONSISTENT.value
    return _diagnosed_torques(torques), msgspec.structs.replace(
        file, verdict=Verdict.UNDECIDABLE.value
    ) if agree else file


def _with_readings(file: DiagnosisFile, recording: Recording) -> DiagnosisFile:
    """With how the examination of the encoders' readings ended: those that were left out take no part."""
    readings = reading_examinations(recording, check(recording))
    return msgspec.structs.replace(file, examinations=(*file.examinations, *readings))


def without_samples(rig: Rig, text: str) -> DiagnosisFile:
    """Of a recording of streams alone, before these are looked at."""
    file = DiagnosisFile(
        schema=SCHEMA,
        verdict=Verdict.CONSISTENT.value,
        noise_floor_m=None,
        rms_before_m=None,
        rms_after_m=None,
        findings=(),
        unexplained=None,
        next=(NEXT_OF_AN_ARM if rig.n_joints else NEXT_OF_ENCODERS,),
        software=SOFTWARE,
        rig=RigRecord(rig.name, rig_sha256(text)),
    )
    return msgspec.structs.replace(file, examinations=pose_examinations(file) if rig.n_joints else ())


def _diagnosed(
    recording: Recording, model: ModelFile | None, keep: Keep | None, begun: Callable[[Stage], None] | None
) -> tuple[Diagnosed, DiagnosisFile]:
    rng = np.random.default_rng(SEED)
    if model is None or model.poses == 0:  # of a motion alone: nothing of it was known at poses

        def causes(so_far: Diagnosed) -> None:
            if keep is not None:
                keep(file_of(so_far, recording))

        found = diagnose_samples(recording.rig, recording.samples, rng, known=causes, begun=begun)
        return _with_streams(file_of(found, recording), recording, found, model)
    known = known_before(model, recording.samples)
    found = diagnose_samples(recording.rig, recording.samples, rng, known.begin, begun=begun)
    if known.same_recording:
        found = only_new(found)  # what its streams show is no part of a model, and not new either
        return found, with_known_model(file_of(found, recording), known, found)
    return _with_streams(with_known_model(file_of(found, recording), known, found), recording, found, model)


def _with_streams(
    file: DiagnosisFile, recording: Recording, found: Diagnosed, model: ModelFile | None
) -> tuple[Diagnosed, DiagnosisFile]:
    stages, fitted = Stages(), None if found.physics is None else found.physics.model
    whole = stages.attempt(Stage.STREAMS, lambda: with_streams(file, streams_of(recording, fitted)), None)
    if whole is None:
        whole = with_streams(file, None, failed=stages.failed[-1].reason)
    broken = TORQUES_IN_MOTION.not_examined("the stage failed", remedy=REPORT)
    torques = stages.attempt(Stage.TORQUES, lambda: _torques_of(recording, model), broken)
    failed = tuple(IncompleteRecord(one.stage.value, one.reason) for one in stages.failed)
    whole = with_controller(with_torques(whole, torques), recording)
    return replace(found, torques=_diagnosed_torques(torques)), msgspec.structs.replace(
        whole, incomplete=(*whole.incomplete, *failed)
    )


def _diagnosed_torques(found: TorqueDiagnosis | ExaminationRecord) -> TorqueDiagnosis | None:
    return found if isinstance(found, TorqueDiagnosis) else None


def _torques_of(recording: Recording, model: ModelFile | None) -> TorqueDiagnosis | ExaminationRecord:
    return diagnose_torques(recording, np.random.default_rng(SEED), None if model is None else model.torques)


def model_of(found: Diagnosed, recording: Recording) -> ModelFile:
    """Geometry with the physics found, and the torques of a motion. DataError where there is none."""
    model, torques = model_of_diagnosis(found, recording), found.torques
    if torques is None or torques.known is not None:
        return model
    return msgspec.structs.replace(model, torques=torques_of_model(torques, recording.path.name))


def model_of_streams(torques: TorqueDiagnosis | None, recording: Recording) -> ModelFile:
    """Of a recording in motion without samples. DataError where no torques were found, or beside a model."""
    if torques is None or torques.known is not None:
        why = "no torques in motion" if torques is None else "beside a model only what has changed is sought"
        raise DataError(f"no model: {why}; diagnose a recording with joint angles and torques without --model")
    return model_of_motion(recording, torques_of_model(torques, recording.path.name))


def plan_next(found: Diagnosed, path: Path) -> str:
    """The poses that separate the alternatives of a diagnosis as a plan at `path`; a sentence about it, or why there is
    none.

    OSError where it cannot be written.
    """
    if found.physics is None:
        return "no plan: no cause was sought; the diagnosis states why"
    physics = found.physics
    try:
        chosen = separating(physics.diagnosis, np.random.default_rng(SEED))
    except DataError as why:  # an effect of the known model that cannot be determined at other poses
        return f"no plan: {why}; diagnose without --model"
    if chosen is None:
        return "no plan: no finding has an alternative explanation that more poses could exclude"
    plan = plan_of(chosen, physics.model)
    write_pose_plan(path, plan)
    return (
        f"{plan.poses} poses that separate the alternative explanations: {path} (margin to expect: "
        f"{chosen.before:.0f} BIC before, "
        f"{chosen.after:.0f} with them)"
    )


def refuse_wrong_file(found: Diagnosed, path: Path) -> None:
    """DataError where the whole file is wrong or cannot be fitted, after that has been written to `path`.

    Too few samples are no fault: they decide nothing.
    """
    if found.physics is not None or any(one.stage is Stage.SEARCH for one in found.incomplete):
        return
    if found.incomplete:
        said = "; ".join(f"{one.stage.value}: {one.reason}" for one in found.incomplete)
        raise DataError(f"no diagnosis, {said} (also in {path})")
    raise DataError(f"{found.why_not} (also in {path}); no physics is sought before that is put right")


def why_kept(path: Path, model: ModelFile, file: DiagnosisFile) -> str:
    """Why the model at `path` is not replaced by that of a diagnosis: it is of the same rig file and readings, and not
    worse. What cannot be read as a model is replaced.
    """
    try:
        there = read_model(path) if path.exists() else None
    except DataError:
        there = None
    if there is None or (there.rig, there.readings_sha256, there.measured_sha256) != (
        model.rig,
        model.readings_sha256,
        model.measured_sha256,
    ):
        return ""
    return no_better_with_physics(file)


def diagnose_to_file(recording: Recording, path: Path) -> tuple[Diagnosed, DiagnosisFile]:
    """diagnosis.json at `path`. DataError as above; OSError where it cannot be written."""
    found, file = diagnose_recording(recording, keep=partial(write_diagnosis, path))
    write_diagnosis(path, file)
    refuse_wrong_file(found, path)
    return found, file
