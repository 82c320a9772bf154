"""model.json and diagnosis.json that are damaged or out of all bounds: one short error with the place and the value."""

import json

import msgspec
import pytest

from calibeam.cli import run
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.record.schema import CurveRecord, DiagnosisFile, FindingRecord
from calibrate.errors import DataError
from calibrate.model.model_file import (
    Covariance,
    ModelFile,
    ModelParameter,
    RigIdentity,
    read_model,
)

MODEL = ModelFile(
    schema=1,
    kind="calibeam-model",
    software="calibeam",
    rig=RigIdentity("two-joints", "0" * 64, "schema = 1"),
    arm_model="dh",
    status="CONVERGED",
    says="",
    poses=3,
    rank=2,
    free=2,
    condition=1.0,
    singular_values=(2.0, 1.0),
    unseen=(),
    parameters=(ModelParameter("joint1.zero", "rad", 1e-3, 1e-5, None),),
    chain={"joint1.zero": 1e-3, "link1.length": 0.0},
    covariance=Covariance(("joint1.zero", "link1.length"), ((1e-10, 0.0), (0.0, 1e-12))),
    noise={"psd": 2e-6},
    repeats=None,
    held_out=None,
    rms_coordinate_before_m=1e-3,
    rms_distance_before_m=1e-3,
    rms_coordinate_after_m=1e-6,
    rms_distance_after_m=1e-6,
    about={"tool": (0.0, 0.0, 0.1), "device": (0.0,) * 6},
)
FINDING = FindingRecord(
    *("joint1.angle", "q1", "harmonic", 1, "encoder-eccentricity"),
    *({}, 0.5, 0.9, "", (), 0.01, 1.0, 1.0),
    curve=CurveRecord("q1", "rad", (0.0, 1.0), (0.0, 1.0), (0.0, None)),
)
DIAGNOSIS = DiagnosisFile(1, "mismatch", 1e-6, 1e-3, 1e-6, (FINDING,), None, ())
DEEP = b'{"schema": 1, "kind": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"


def changed(record, *path_and_value):
    """JSON of a record with one value replaced."""
    *path, last, value = path_and_value
    content = json.loads(msgspec.json.encode(record))
    inner = content
    for step in path:
        inner = inner[step]
    inner[last] = value
    return json.dumps(content).encode()


def refused(path, data, read):
    """What is reported of a file, without its folder."""
    path.write_bytes(data)
    with pytest.raises(DataError) as caught:
        read(path)
    lines = str(caught.value).replace(str(path.parent), ".")
    assert len(lines) <= 300
    return lines


MODELS = {
    "deep": (DEEP, "not a model.json (lists or objects hundreds deep)"),
    "empty": (b"", "not a model.json (Input data was truncated)"),
    "a list": (b"[]", "not a model.json (it holds no object)"),
    "utf8": (changed(MODEL, "status", "OK").replace(b"OK", b"\xff"), "line 1: byte"),
    "another schema": (changed(MODEL, "schema", 7), "kind 'calibeam-model', schema 7; expected 'calibeam-model'"),
    "chain": (changed(MODEL, "chain", "joint1.zero", 1e308), "chain.joint1.zero = 1e+308: expected float <= 1000000"),
    "negative": (changed(MODEL, "chain", "joint1.zero", -1e308), "chain.joint1.zero = -1e+308: expected float >= -1"),
    "key": (changed(MODEL, "chain", "x" * 10**6, 0.0), "as a key"),
    "about": (changed(MODEL, "about", "tool", [0.0]), "about.tool holds 1 numbers instead of 6"),
    "about numbers": (changed(MODEL, "about", "tool", 0, 1e308), "about.tool.0 = 1e+308: expected float <= 1000"),
    "row": (changed(MODEL, "covariance", "rows", 0, [1.0]), "covariance.rows is not square, 2 by 2, as the 2 names"),
    "names": (changed(MODEL, "covariance", "names", ["a"]), "covariance.rows is not square, 1 by 1"),
    "name": (changed(MODEL, "rig", "name", "x" * 10**7), "rig.name = xxxxx"),
    "large": (changed(MODEL, "says", "x" * 4 * 10**7), "larger than 32 MB, which no model.json is"),
    "value": (
        changed(MODEL, "parameters", 0, "value", 1e308),
        "parameters.0.value = 1e+308: expected float <= 1000000",
    ),
    "rms": (changed(MODEL, "rms_distance_after_m", 1e308), "rms_distance_after_m = 1e+308: expected float <="),
    "arm": (changed(MODEL, "arm_model", "scara"), "arm_model = scara: expected str matching regex"),
    "type": (changed(MODEL, "poses", ["x" * 10**6]), "poses: expected int, got array"),
}


@pytest.mark.parametrize(("data", "says"), MODELS.values(), ids=MODELS)
def test_a_faulty_model_is_refused_with_its_place(tmp_path, data, says):
    assert says in refused(tmp_path / "model.json", data, read_model)


DIAGNOSES = {
    "deep": (DEEP, "not a diagnosis.json (lists or objects hundreds deep)"),
    "utf8": (changed(DIAGNOSIS, "verdict", "OK").replace(b"OK", b"\xff"), "line 1: byte"),
    "curve": (changed(DIAGNOSIS, "findings", 0, "curve", "values", [0.0]), "of a curve are of different lengths"),
    "confidence": (changed(DIAGNOSIS, "findings", 0, "confidence", 1e308), "findings.0.confidence = 1e+308: expected"),
    "name": (changed(DIAGNOSIS, "findings", 0, "where", "x" * 10**6), "findings.0.where = xxxxx"),
}


@pytest.mark.parametrize(("data", "says"), DIAGNOSES.values(), ids=DIAGNOSES)
def test_a_faulty_diagnosis_is_refused_with_its_place(tmp_path, data, says):
    assert says in refused(tmp_path / "diagnosis.json", data, read_diagnosis)


def test_good_files_come_back_as_they_were(tmp_path):
    path = tmp_path / "any.json"
    path.write_bytes(msgspec.json.encode(MODEL))
    assert read_model(path) == MODEL
    path.write_bytes(msgspec.json.encode(DIAGNOSIS))
    assert read_diagnosis(path) == DIAGNOSIS


@pytest.mark.parametrize(
    "words",
    [
        "predict {} samples.csv",
        "simulate-errors {}",
        "report s --against {}",
        "verify s --model {}",
        "diagnose s --model {}",
    ],
)
@pytest.mark.parametrize("fault", ["deep", "utf8", "row", "chain"])
def test_every_command_ends_with_one_line_and_code_1(tmp_path, capsys, words, fault):
    path = tmp_path / "model.json"
    path.write_bytes(MODELS[fault][0])
    session = tmp_path / "s"
    session.mkdir()
    (session / "rig.toml").write_text(RIG)
    (session / "samples.csv").write_text("t_s,q1_rad,x_m,y_m,z_m\n0,0,0,0,0\n")
    assert run([word.format(path) if word != "s" else str(session) for word in words.split()]) == 1
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert MODELS[fault][1] in said
    assert said.count("\n") == 1


RIG = """schema = 1
name = "one-joint"
[arm]
model = "dh"
[[arm.joint]]
a_m = 0.3
alpha_rad = 0.0
d_m = 0.1
lower_rad = -3.0
upper_rad = 3.0
"""
