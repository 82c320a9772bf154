"""How the examinations of settled poses end: by sessions that are whole, faulty, short, and whose stages fail."""

import csv
import shutil
from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording import read
from calibeam.results.diagnosis import without_samples
from calibrate.diagnose import from_recording
from calibrate.diagnose.assess import assessment
from calibrate.diagnose.from_recording import diagnose_samples
from calibrate.diagnose.record import to_file
from calibrate.diagnose.record.pose_examinations import FAULTS, PHYSICS, POSE_EXAMINATIONS, pose_examinations
from calibrate.diagnose.record.schema import IncompleteRecord
from calibrate.diagnose.record.to_file import file_of
from calibrate.diagnose.stages import NOT_YET
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted
from tests.calibrate.diagnose.record.test_file import FINDING

SAMPLES = 40
WRONG_M = 3e-2  # far beyond any noise


def broken(*_args, **_kwargs):
    raise np.linalg.LinAlgError("singular matrix")


@pytest.fixture(scope="module")
def healthy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("healthy")
    write_case(conceal(Wanted("tracker", 5, defects=(), samples=SAMPLES, arm="irb120")), folder)
    return folder / "recording"


@pytest.fixture
def session(tmp_path, healthy):
    """A recording of so many samples; `change`: of the rows of its table, text by column."""

    def made(rows=SAMPLES, change=lambda table: None):
        folder = Path(shutil.copytree(healthy, tmp_path / "session"))
        path = folder / "samples.csv"
        with path.open(newline="", encoding="utf-8") as file:
            table = list(csv.DictReader(file))[:rows]
        change(table)
        with path.open("w", newline="", encoding="utf-8") as file:
            out = csv.DictWriter(file, table[0])
            out.writeheader()
            out.writerows(table)
        return read(folder)

    return made


def diagnosis(recording):
    return file_of(diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1)), recording)


def endings(file):
    said = {one.what: one for one in file.examinations}
    assert set(said) == {one.what for one, _ in POSE_EXAMINATIONS}
    return said[FAULTS.what], said[PHYSICS.what]


def test_a_whole_session_states_what_would_have_been_found(session):
    faults, physics = endings(diagnosis(session()))
    assert (faults.outcome, physics.outcome) == ("nothing found", "nothing found")
    assert "six times the noise" in faults.says
    assert " at " in physics.says


def test_a_wrong_row_is_a_fault_of_the_file(session):
    def wrong(table):
        table[7]["x_m"] = repr(float(table[7]["x_m"]) + WRONG_M)

    file = diagnosis(session(change=wrong))
    faults, _ = endings(file)
    assert (faults.outcome, faults.says) == ("found", file.blunders[0].says)


def test_too_few_samples_are_not_examined_and_more_are_the_remedy(session):
    faults, physics = endings(diagnosis(session(rows=6)))
    assert physics.outcome == "not examined"
    assert physics.reason.startswith("search: 6 samples")
    assert (physics.remedy, physics.expected) == ("measure more poses", True)
    assert faults.outcome == "nothing found"


def test_a_cause_that_was_found_is_the_ending_of_physics(session):
    file = msgspec.structs.replace(diagnosis(session()), findings=(FINDING,))
    assert endings(msgspec.structs.replace(file, examinations=pose_examinations(file)))[1].says == FINDING.says


@pytest.mark.parametrize(
    ("module", "name", "stage", "place"),
    [
        (from_recording, "gross_errors_first", "faults of the file", 0),
        (from_recording, "session_of", "geometry", 1),
        (assessment, "search", "search", 1),
        (to_file, "smallest_visible", "detection limits", 1),
    ],
)
def test_a_stage_that_failed_is_the_reason(session, monkeypatch, module, name, stage, place):
    monkeypatch.setattr(module, name, broken)
    one = endings(diagnosis(session()))[place]
    assert (one.outcome, one.expected) == ("not examined", True)
    assert one.reason.startswith(f"{stage}: LinAlgError")
    assert "report the recording" in one.remedy


def test_without_samples_nothing_is_examined_and_nothing_was_expected(session):
    recording = session()
    for one in endings(without_samples(recording.rig, recording.rig_text)):
        assert (one.outcome, one.reason, one.expected) == ("not examined", "no settled samples were recorded", False)
        assert "`calibeam session`" in one.remedy


def test_a_diagnosis_that_is_under_way_has_no_ending_yet(session):
    file = diagnosis(session())
    early = msgspec.structs.replace(file, incomplete=(IncompleteRecord("sizes", NOT_YET),))
    assert pose_examinations(early) == ()
