"""diagnosis.json: published names to the letter, back again without loss, one sentence for a file that is none."""

import json

import pytest

from calibrate.diagnose.record.file import read_diagnosis, write_diagnosis
from calibrate.diagnose.record.schema import (
    DiagnosisFile,
    FindingRecord,
    RivalRecord,
    SizeRecord,
    UnexplainedRecord,
)
from calibrate.errors import DataError

RIVAL = RivalRecord("joint2.angle", "q2", "linear", None, "gear-ratio-error", confidence=0.02, margin=5.1)
FINDING = FindingRecord(
    "joint3.angle",
    "q3",
    "harmonic",
    1,
    "encoder-eccentricity",
    parameters={"amplitude_rad": SizeRecord(1.1e-4, 4e-6)},
    share=0.83,
    confidence=0.998,
    says="Joint 3 reads off by 110 µrad",
    rivals=(RIVAL,),
    p=1e-9,
    bic_gain=80.0,
    held_out_gain=70.0,
)
FILE = DiagnosisFile(
    schema=1,
    verdict="mismatch",
    noise_floor_m=2.1e-6,
    rms_before_m=4.1e-5,
    rms_after_m=2.4e-6,
    findings=(FINDING,),
    unexplained=UnexplainedRecord("joint5.angle", "q5,t", 1e-6, 0.2, 0.003, "a curve"),
    next=("record payload_kg",),
)
PUBLISHED = {
    "schema", "verdict", "noise_floor_m", "rms_before_m", "rms_after_m", "findings", "unexplained", "next",
}  # fmt: skip
OF_A_FINDING = {
    "where", "depends_on", "shape", "order", "physics", "parameters", "share", "confidence", "says", "rivals",
}  # fmt: skip


def test_what_is_written_is_read_back(tmp_path):
    path = tmp_path / "new" / "diagnosis.json"
    write_diagnosis(path, FILE)
    assert read_diagnosis(path) == FILE
    assert [p.name for p in path.parent.iterdir()] == ["diagnosis.json"]


def test_the_published_names_are_there(tmp_path):
    write_diagnosis(tmp_path / "d.json", FILE)
    said = json.loads((tmp_path / "d.json").read_text())
    assert set(said) >= PUBLISHED
    (finding,) = said["findings"]
    assert set(finding) >= OF_A_FINDING
    assert finding["parameters"] == {"amplitude_rad": {"value": 1.1e-4, "sigma": 4e-6}}
    assert set(finding["rivals"][0]) >= {"where", "depends_on", "shape", "physics", "confidence"}
    assert set(said["unexplained"]) >= {"where", "depends_on", "rms_m"}


@pytest.mark.parametrize(
    ("text", "said"),
    [("{", "not a diagnosis.json"), ('{"schema": 7}', "schema 7"), ('{"schema": 1}', "damaged")],
)
def test_a_file_that_is_none_is_one_sentence(tmp_path, text, said):
    path = tmp_path / "d.json"
    path.write_text(text)
    with pytest.raises(DataError, match=said) as lines:
        read_diagnosis(path)
    assert str(path) in str(lines.value)


def test_a_file_that_is_not_there_is_one_sentence(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_diagnosis(tmp_path / "none.json")
