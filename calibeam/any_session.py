"""From any recording or session folder to a model of the arm, whatever instruments it holds."""

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Recording, readings_sha256
from acquisition.recording.rig import rig_sha256
from calibrate.fit_plan import DEFAULT, FitPlan, read_plan
from calibrate.identification.identify import identify
from calibrate.identification.record import record_of
from calibrate.identification.result import Identification
from calibrate.model_file import ModelFile, RigIdentity, write_model


@dataclass(frozen=True)
class Planned:
    """A fit plan and its text, which travels with the model."""

    plan: FitPlan = DEFAULT
    text: str | None = None

    @classmethod
    def read(cls, path: Path | None) -> "Planned":
        """The plan of a file, the defaults without one. DataError for what is wrong in it."""
        return cls() if path is None else cls(*read_plan(path))


def identify_session(
    recording: Recording, planned: Planned | None = None, bootstrap_rounds: int | None = None
) -> Identification:
    """The arm by all instruments of the recording. DataError when it holds nothing to fit, or is a blunder as such."""
    plan = DEFAULT if planned is None else planned.plan
    rng = np.random.default_rng(plan.seed)
    return identify(recording.rig, recording.samples, rng=rng, plan=plan, bootstrap_rounds=bootstrap_rounds)


def session_model(result: Identification, recording: Recording, planned: Planned | None = None) -> ModelFile:
    """What model.json holds, with the rig in it."""
    text, rig = recording.rig_text, recording.rig
    told = Planned() if planned is None else planned
    arm_model = (told.plan.model or rig.arm.model).value
    identity, readings = RigIdentity(rig.name, rig_sha256(text), text), readings_sha256(recording.samples)
    return msgspec.structs.replace(record_of(result, identity, arm_model, told.text), readings_sha256=readings)


def write_session_model(
    result: Identification, recording: Recording, path: Path, planned: Planned | None = None
) -> ModelFile:
    """Write model.json; returns its content."""
    model = session_model(result, recording, planned)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(path, model)
    return model
