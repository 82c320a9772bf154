"""What follows a recording: identify, diagnose, write model.json, diagnosis.json, report.html beside it, print.

Needs no device any more.
"""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from acquisition.recording import Recording, read
from calibeam.any_session import identify_session, write_session_model
from calibeam.diagnosis import diagnosed_to
from calibeam.diagnosis_lines import print_diagnosis
from calibeam.outcome import PartialResult, interruption
from calibeam.reporting import write_any_report
from calibeam.session_table import print_identification
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.identification.result import Identification
from calibrate.model_file import write_model
from calibrate.physics.from_diagnosis import model_of_diagnosis
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_verdict import session_verdict


def conclude(recording_path: Path, console: Console) -> Identification:
    """Model, diagnosis, report into the recording's folder, which may be given for all its parts.

    PartialResult when that cannot be done.
    """
    with recording_kept(recording_path):
        return _concluded(recording_path, console)


@contextmanager
def recording_kept(recording_path: Path) -> Generator[None]:
    """Whatever ends what follows a recording, the recording is whole: PartialResult says so and how to go on."""
    try:
        yield
    except (KeyboardInterrupt, DataError, OSError) as why:
        reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
        raise PartialResult(
            f"{reason}; the recording is whole: {recording_path}; "
            "`calibeam identify`, `diagnose` and `report` go on from there"
        ) from why


def _concluded(recording_path: Path, console: Console) -> Identification:
    recording, folder = read(recording_path), _folder_of(recording_path)
    result = identify_session(recording)
    model = write_session_model(result, recording, folder / "model.json")
    print_identification(console, result, session_verdict(session_evidence(recording, model)), recording.rig)
    console.print(f"model: {folder / 'model.json'}", markup=False)
    diagnosis = diagnosed(recording, folder, console)
    write_any_report(recording, model, folder / "report.html", diagnosis)
    console.print(f"report: {folder / 'report.html'}", markup=False)
    return result


def _folder_of(recording_path: Path) -> Path:
    """Results stand beside the recording, or among the parts of one."""
    return recording_path if recording_path.is_dir() else recording_path.parent


def diagnosed(recording: Recording, folder: Path, console: Console) -> DiagnosisFile | None:
    """Writes diagnosis.json, and model.json with the physics found in place of the identified geometry.

    None, with the reason printed, where there is too little to diagnose: model.json then stays as identified.
    """
    path = folder / "diagnosis.json"
    try:
        found, file = diagnosed_to(recording, path)
    except DataError as why:
        console.print(f"no diagnosis: {why}", highlight=False, markup=False)
        return None
    print_diagnosis(console, file)
    console.print(f"diagnosis: {path}", markup=False)
    try:
        write_model(folder / "model.json", model_of_diagnosis(found, recording))
    except DataError as why:
        console.print(f"model.json holds the identified geometry only: {why}", highlight=False, markup=False)
    return file
