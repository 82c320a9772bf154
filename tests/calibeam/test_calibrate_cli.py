"""`calibrate`: model, diagnosis and report in one folder; physics only where unseen rows are better with it."""

import json

import msgspec
import pytest

from calibeam.cli import run
from calibeam.results.diagnosis import why_kept
from calibrate.diagnose.record.file import read_diagnosis
from calibrate.diagnose.record.schema import no_better_with_physics
from calibrate.model.model_file import read_model
from simulators.conceal.case import conceal
from simulators.conceal.case_files import write_case
from simulators.conceal.wanted import Wanted

MOST_LINES = 20  # of 80 columns: the ten lines of the verdict wrap, and three files


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A tracker before a small arm whose second joint's encoder disc is off centre."""
    where = tmp_path_factory.mktemp("concealed")
    wanted = Wanted("tracker", 31, defects=("encoder-eccentricity",), enr=2.0, samples=100, arm="irb120")
    write_case(conceal(wanted), where)
    return where / "recording"


@pytest.fixture(scope="module")
def out(folder, tmp_path_factory):
    path = tmp_path_factory.mktemp("calibrated") / "calibration"
    assert run(["calibrate", str(folder), "--out", str(path)]) == 0
    return path


def test_one_command_leaves_the_model_with_what_was_found_its_diagnosis_and_the_report(out):
    model, diagnosis = (json.loads((out / name).read_text()) for name in ("model.json", "diagnosis.json"))
    found = [(f["where"], f["physics"]) for f in diagnosis["findings"]]
    assert [(e["where"], e["physics"]) for e in model["effects"]] == found != []
    assert 'id="finding-1"' in (out / "report.html").read_text(encoding="utf-8")


def test_the_verdict_fits_a_screen_and_names_the_cause(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run(["calibrate", str(folder), "--out", str(tmp_path / "c")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= MOST_LINES, "\n".join(lines)
    assert "trust: yes" in lines  # of the model with the physics, not of the geometry alone
    assert any(line.startswith("1. Joint ") for line in lines)


def test_a_folder_with_results_is_left_alone(folder, out, capsys):
    before = (out / "model.json").read_bytes()
    assert run(["calibrate", str(folder), "--out", str(out)]) == 1
    assert str(out) in "".join(capsys.readouterr().err.split("\n"))
    assert (out / "model.json").read_bytes() == before


@pytest.mark.parametrize(
    ("removed", "replaces"),
    [
        (((0.3, 0.5), (0.2, 0.6)), True),
        (((0.3, 0.5), (-0.2, 0.6)), True),
        (((0.3, 0.5), (-0.4, -0.1)), False),  # the end of the session is predicted worse
        (((-0.1, 0.2), (-0.3, 0.1)), False),
        (((None, None),), False),
        ((), False),
    ],
)
def test_physics_replaces_geometry_where_unseen_rows_are_better_for_certain_and_nowhere_worse(out, removed, replaces):
    file = read_diagnosis(out / "diagnosis.json")
    one = file.splits[0]
    splits = tuple(msgspec.structs.replace(one, removed_low=low, removed_high=high) for low, high in removed)
    assert (no_better_with_physics(msgspec.structs.replace(file, splits=splits)) == "") is replaces


def test_geometry_stays_where_no_cause_was_found(out):
    file = read_diagnosis(out / "diagnosis.json")
    assert no_better_with_physics(msgspec.structs.replace(file, findings=()))


def test_a_model_of_the_same_readings_is_kept_where_the_new_one_is_no_better(out, tmp_path):
    file, model = read_diagnosis(out / "diagnosis.json"), read_model(out / "model.json")
    nothing_found = msgspec.structs.replace(file, findings=())
    assert why_kept(out / "model.json", model, nothing_found)
    assert why_kept(out / "model.json", model, file) == ""
    assert why_kept(tmp_path / "model.json", model, nothing_found) == ""
    other_rig = msgspec.structs.replace(model.rig, sha256="0" * 64)
    for other in ({"readings_sha256": "0" * 64}, {"measured_sha256": "0" * 64}, {"rig": other_rig}):
        assert why_kept(out / "model.json", msgspec.structs.replace(model, **other), nothing_found) == ""
    (tmp_path / "damaged.json").write_text("{")
    assert why_kept(tmp_path / "damaged.json", model, nothing_found) == ""
