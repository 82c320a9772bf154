"""From any recording or session folder to a model of the arm, whatever instruments it holds."""

from pathlib import Path

import numpy as np

from acquisition.recording.columns import POSITION, SPOTS
from acquisition.recording.recording import Recording
from acquisition.recording.rig import rig_sha256
from acquisition.recording.samples import Samples
from calibeam.identification import SPLIT_SEED
from calibrate.identification.identify import identify
from calibrate.identification.record import record_of
from calibrate.identification.result import Identification
from calibrate.model_file import ModelFile, RigIdentity, write_model

OTHERS = (POSITION[0], "wire_m", "seat", "bar")  # columns of the instruments beside the dual PSD


def only_spots(samples: Samples) -> bool:
    """Whether the dual PSD is the only instrument: its session asks for joint zeros, and has a method of its own."""
    return SPOTS[0] in samples and not any(
        name in samples and bool(np.any(np.isfinite(samples.column(name)))) for name in OTHERS
    )


def identify_session(recording: Recording) -> Identification:
    """The arm by all instruments of the recording. DataError when it holds nothing to fit, or is a blunder as such."""
    return identify(recording.rig, recording.samples, rng=np.random.default_rng(SPLIT_SEED))


def write_session_model(result: Identification, recording: Recording, path: Path) -> ModelFile:
    """model.json, with the rig in it."""
    text = recording.rig_text
    model = record_of(result, RigIdentity(recording.rig.name, rig_sha256(text), text), recording.rig.arm.model.value)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_model(path, model)
    return model
