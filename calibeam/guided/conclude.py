"""What follows a guided session: identify, diagnose, write model.json, diagnosis.json, report.html beside it, print."""

from pathlib import Path

from rich.console import Console

from acquisition.recording.read import read
from calibeam.any_session import identify_session, write_session_model
from calibeam.conclude import diagnosed, recording_kept
from calibeam.reporting import write_any_report
from calibeam.session_table import print_identification
from calibrate.report.session_evidence import session_evidence
from calibrate.report.session_verdict import session_verdict


def conclude_guided(recording_path: Path, console: Console, *, diagnose: bool = True) -> None:
    """Model, diagnosis, report into the recording's folder. PartialResult when that cannot be done."""
    with recording_kept(recording_path):
        _concluded(recording_path, console, diagnose)


def _concluded(recording_path: Path, console: Console, diagnose: bool) -> None:
    recording, folder = read(recording_path), recording_path.parent
    result = identify_session(recording)
    model = write_session_model(result, recording, folder / "model.json")
    print_identification(console, result, session_verdict(session_evidence(recording, model)))
    console.print(f"model: {folder / 'model.json'}", markup=False)
    diagnosis = diagnosed(recording, folder, console) if diagnose else None
    write_any_report(recording, model, folder / "report.html", diagnosis)
    console.print(f"report: {folder / 'report.html'}", markup=False)
