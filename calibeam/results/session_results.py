"""What follows a recording: identify, diagnose, write model.json, diagnosis.json and report.html beside it, print.

Needs no device any more.
"""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from numpy.random import default_rng

from acquisition.recording import Recording, read
from acquisition.recording.output import OutputError
from calibeam.console import Console
from calibeam.outcome import PartialResult, interruption
from calibeam.printing.identification import print_identification
from calibeam.printing.results import calibration_lines, print_diagnosis, unseen_words
from calibeam.results.identification import (
    identify_session,
    refuse_undetermined,
    session_model,
    write_session_model,
)
from calibrate.diagnose.record.schema import DiagnosisFile, no_better_with_physics
from calibrate.diagnose.with_model import model_of_diagnosis
from calibrate.errors import DataError
from calibrate.fit.identify.result import Identification
from calibrate.model.model_file import ModelFile, write_model
from calibrate.report.drift import Calibration, drift_of
from calibrate.report.elements.html import write_page
from calibrate.report.elements.verdict import TOOL, Answers
from calibrate.report.evidence import session_evidence
from calibrate.report.session_report import session_answers, session_page
from calibrate.report.workspace import session_arm, session_room

NOW = "now"
ALONE = "the model is the identified geometry alone"
MODEL_NAME, DIAGNOSIS_NAME = "model.json", "diagnosis.json"


def write_recording_report(
    recording: Recording,
    model: ModelFile | None,
    path: Path,
    diagnosis: DiagnosisFile | None = None,
    *,
    against: Calibration | None = None,
    interactive: bool = False,
) -> Answers:
    """The report at `path`; without a model the recording is identified again, without a plan. Returns its first
    screen.

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
    room = session_room(known)
    write_page(path, session_page(known, diagnosis, drift, interactive=interactive, room=room))
    return session_answers(known, drift, room, diagnosis)


def write_session_results(recording_path: Path, console: Console) -> Identification:
    """Model, diagnosis, report into the recording's folder, which may be given for all its parts.

    PartialResult when that cannot be done.
    """
    with recording_kept(recording_path):
        return _concluded(recording_path, console)


@contextmanager
def recording_kept(recording_path: Path) -> Generator[None]:
    """Whatever ends what follows a recording, the recording is whole: PartialResult states it and how to go on."""
    try:
        yield
    except (KeyboardInterrupt, DataError, OutputError, OSError) as why:
        reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
        raise PartialResult(
            f"{reason}; the recording is whole: {recording_path}; "
            "`calibeam identify`, `diagnose` and `report` go on from there"
        ) from why


def _concluded(recording_path: Path, console: Console) -> Identification:
    return calibrate(read(recording_path), _folder_of(recording_path), console)


def calibrate(recording: Recording, folder: Path, console: Console, *, verbose: bool = False) -> Identification:
    """Identifies, diagnoses, proves on unseen rows; writes model.json, diagnosis.json, report.html; prints ten lines.

    The model has the physics found where the same unseen rows are predicted better with it for certain, else the
    identified geometry alone.
    `verbose`: all that `identify` and `diagnose` print. DataError where nothing can be identified.
    """
    result = identify_session(recording)
    refuse_undetermined(result.status, result.estimates)
    identified = write_session_model(result, recording, folder / MODEL_NAME)
    kept = write_session_diagnosis(recording, folder, identified)
    answers = write_recording_report(recording, kept.model, folder / "report.html", kept.compared)
    if verbose:  # every file stands before the first line: who reads may end early
        print_identification(console, result, session_evidence(recording, identified), verbose=True)
        if kept.diagnosis is not None:
            print_diagnosis(console, kept.diagnosis, verbose=True)
    for line in (*calibration_lines(answers, kept.diagnosis, kept.says), *_files(folder, kept.diagnosis)):
        console.print(line, markup=False, highlight=False)
    console.print(accuracy_of(answers), style="bold", markup=False, highlight=False)
    return result


def _files(folder: Path, diagnosis: DiagnosisFile | None) -> Iterator[str]:
    yield f"model: {folder / MODEL_NAME}"
    if diagnosis is not None:
        yield f"diagnosis: {folder / DIAGNOSIS_NAME}"
    yield f"report: {folder / 'report.html'}"


def accuracy_of(answers: Answers) -> str:
    """One number for whoever asks how good the arm is now, as the first screen of the report has it, and its limit."""
    tool = [number for number in answers.numbers if number.key.startswith(TOOL) and number.value is not None]
    if not tool:
        return answers.verdict.sentence
    limit = f"; {answers.limit}" if answers.limit else ""
    return f"in one number: tool error {tool[-1].said} ({tool[-1].name}; {tool[0].said} {tool[0].name}){limit}"


def _folder_of(recording_path: Path) -> Path:
    """Results stand beside the recording, or among the parts of one."""
    return recording_path if recording_path.is_dir() else recording_path.parent


@dataclass(frozen=True)
class KeptModel:
    """What stands in model.json, why, and the diagnosis as its file has it; None where there is too little for one."""

    model: ModelFile
    says: str  # a sentence
    diagnosis: DiagnosisFile | None
    compared: DiagnosisFile | None  # with proofs against the identified geometry, for the report


def write_session_diagnosis(recording: Recording, folder: Path, identified: ModelFile) -> KeptModel:
    """Writes diagnosis.json, and model.json with the physics found in place of the `identified` geometry where that
    predicts the same unseen rows better for certain.
    """
    from calibeam.results.diagnosis import SEED, diagnose_to_file  # a report starts without it

    try:
        found, file = diagnose_to_file(recording, folder / DIAGNOSIS_NAME)
    except DataError as why:
        return KeptModel(identified, f"{ALONE}: no diagnosis: {why}", None, None)
    if not any(one.stream is None for one in file.findings):
        return KeptModel(identified, f"{ALONE}: {no_better_with_physics(file)}", file, file)
    from calibrate.report.unseen_by_both import compared_on_unseen_rows  # with all of a search

    try:
        compared, why_not = compared_on_unseen_rows(recording, identified, found, file, default_rng(SEED)), ""
    except DataError as why:
        compared, why_not = file, f"; beside the geometry of the diagnosis, since {why}"
    numbers = unseen_words(compared) + why_not
    if no_better := no_better_with_physics(compared):
        return KeptModel(identified, f"{ALONE}: {no_better}: {numbers}", file, compared)
    try:
        model = model_of_diagnosis(found, recording)
    except DataError as why:
        return KeptModel(identified, f"{ALONE}: {why}", file, compared)
    write_model(folder / MODEL_NAME, model)
    return KeptModel(model, f"the model holds the physics found: {numbers}", file, compared)
