"""An earlier calibration, from whatever is left of it: a model.json, the folder of a session, or a recording."""

from pathlib import Path

from acquisition.recording import Recording, read
from calibeam.modelled import modelled
from calibrate.diagnose.file import read_diagnosis
from calibrate.model_file import read_model
from calibrate.report.drift.drift import Calibration

MODEL, DIAGNOSIS = "model.json", "diagnosis.json"  # as sessions name them


def earlier_calibration(path: Path) -> Calibration:
    """DataError, RecordingError for what is none. A recording is identified anew, without a plan."""
    if path.suffix == ".json":
        return Calibration(str(path), read_model(path))
    if path.is_dir() and (path / MODEL).exists():
        told = path / DIAGNOSIS
        return Calibration(str(path), read_model(path / MODEL), None, read_diagnosis(told) if told.exists() else None)
    recording = read(path)
    return Calibration(_label(recording), modelled(recording).model, recording)


def _label(recording: Recording) -> str:
    """The day, where the recording says it."""
    return recording.started_utc.partition("T")[0] or recording.path.name
