"""What follows a guided session: identify, diagnose, write model.json, diagnosis.json, report.html beside it, print."""

from pathlib import Path

from rich.console import Console

from acquisition.recording.read import read
from acquisition.recording.recording import Recording
from calibeam.any_session import identify_session, write_session_model
from calibeam.diagnosis import diagnosed_to
from calibeam.diagnosis_lines import print_diagnosis
from calibeam.outcome import PartialResult
from calibeam.reporting import write_any_report
from calibeam.session_table import print_identification
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_verdict import session_verdict


def conclude_guided(recording_path: Path, console: Console, *, diagnose: bool = True) -> None:
    """Model, diagnosis, report into the recording's folder. PartialResult when that cannot be done."""
    try:
        _concluded(recording_path, console, diagnose)
    except (KeyboardInterrupt, DataError, OSError) as why:
        reason = "Ctrl-C" if isinstance(why, KeyboardInterrupt) else str(why)
        raise PartialResult(
            f"{reason}; the recording is whole: {recording_path}; "
            "`calibeam identify`, `diagnose` and `report` go on from there"
        ) from why


def _concluded(recording_path: Path, console: Console, diagnose: bool) -> None:
    recording, folder = read(recording_path), recording_path.parent
    result = identify_session(recording)
    model = write_session_model(result, recording, folder / "model.json")
    print_identification(console, result, session_verdict(session_evidence(recording, model)))
    console.print(f"model: {folder / 'model.json'}", markup=False)
    diagnosis = _diagnosed(recording, folder / "diagnosis.json", console) if diagnose else None
    write_any_report(recording, model, folder / "report.html", diagnosis)
    console.print(f"report: {folder / 'report.html'}", markup=False)


def _diagnosed(recording: Recording, path: Path, console: Console) -> DiagnosisFile | None:
    """None, and said, where there is too little to diagnose: what was identified stands all the same."""
    try:
        file = diagnosed_to(recording, None, path)
    except DataError as why:
        console.print(f"no diagnosis: {why}", highlight=False, markup=False)
        return None
    print_diagnosis(console, file)
    console.print(f"diagnosis: {path}", markup=False)
    return file
