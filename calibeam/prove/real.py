"""Real recordings: what is found, what remains, and what is inferred of columns that were hidden on purpose."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Recording, Samples, read
from acquisition.recording.session_folder import CSV, RIG, write_csv
from calibeam.prove.diagnosing import Answered, diagnose_cases
from calibeam.prove.hidden_angle import HiddenAngle, hidden_angles
from calibeam.prove.hidden_column import HiddenColumn, against_hidden
from calibeam.prove.layout import Layout
from calibrate.diagnose.file import read_diagnosis
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.errors import DataError
from calibrate.report.diagnosis.page import write_diagnosis_report

ROOM = "temp_room_degC"
BLIND = "-blind"  # of the name of a recording with a column hidden
MOST_SAMPLES = 1000  # of a long session: every n-th row, over the whole of its time


class RealScore(msgspec.Struct, frozen=True):
    """One set. Nobody knows the truth of it: error on unseen samples, and hidden columns, are all that counts."""

    name: str
    samples: int
    error: str
    diagnosis: DiagnosisFile | None
    angles: tuple[HiddenAngle, ...]
    columns: tuple[HiddenColumn, ...]
    blind: DiagnosisFile | None = None  # without the room's temperature; None where the file has none


def real_sets(data: Path) -> tuple[Path, ...]:
    """Session folders in a folder. DataError where there are none."""
    found = tuple(sorted(p.parent for p in data.glob(f"*/{RIG}") if (p.parent / CSV).is_file()))
    if not found:
        raise DataError(f"{data}: no session folder with {RIG} and {CSV} in it; give the folder that holds them")
    return found


def prove_real(data: Path, out: Path, jobs: int, tell: Callable[[str], None]) -> tuple[RealScore, ...]:
    """Every set of a folder, diagnosed by processes that see only what is not hidden."""
    layout = Layout(out)
    sets = {folder.name: thinned(read(folder)) for folder in real_sets(data)}
    names: list[str] = []
    for name, recording in sets.items():
        names += _laid_out(layout, name, recording)
    answers: dict[str, Answered] = {}
    with closing(diagnose_cases(layout, names, jobs)) as coming:
        for answer in coming:
            answers[answer.name] = answer
            tell(f"diagnosed {answer.name}" + (f": {answer.error}" if answer.error else ""))
    return tuple(_scored(layout, name, recording, answers) for name, recording in sets.items())


def thinned(recording: Recording) -> Recording:
    """Every n-th sample, so that no more than `MOST_SAMPLES` are left."""
    step = -(-len(recording.samples) // MOST_SAMPLES)
    if step == 1:
        return recording
    return replace(recording, samples=recording.samples.take(np.arange(0, len(recording.samples), step)))


def _laid_out(layout: Layout, name: str, recording: Recording) -> Sequence[str]:
    """Writes the recording, and once more without a column that it has."""
    _write(layout.recording(name), recording, ())
    if ROOM not in recording.samples:
        return (name,)
    _write(layout.recording(name + BLIND), recording, (ROOM,))
    return (name, name + BLIND)


def _write(folder: Path, recording: Recording, hidden: Sequence[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / RIG).write_text(recording.rig_text, encoding="utf-8")
    kept = {name: values for name, values in recording.samples.columns.items() if name not in hidden}
    write_csv(Samples(kept, recording.samples.n_joints), folder / CSV)


def _scored(layout: Layout, name: str, recording: Recording, answers: Mapping[str, Answered]) -> RealScore:
    if answers[name].error:
        return RealScore(name, len(recording.samples), answers[name].error, None, (), ())
    file = read_diagnosis(layout.answer(name) / "diagnosis.json")
    write_diagnosis_report(layout.out / f"{name}.html", recording, file)
    columns: tuple[HiddenColumn, ...] = ()
    blind: DiagnosisFile | None = None
    if name + BLIND in answers and not answers[name + BLIND].error:
        blind = read_diagnosis(layout.answer(name + BLIND) / "diagnosis.json")
        columns = against_hidden(blind, recording.samples, ROOM)
    return RealScore(name, len(recording.samples), "", file, hidden_angles(recording), columns, blind)
