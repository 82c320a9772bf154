"""`calibeam COMMAND ... | head -1`: every file is written before the text that nobody reads to its end."""

import os
import sys
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from calibeam.cli import run

DATA = Path(__file__).parents[1] / "golden" / "data"
JOINT = DATA / "sessions" / "tracker-soft-joint"


@contextmanager
def closed_output():
    """Standard output whose reader has gone."""
    reader, writer = os.pipe()
    os.close(reader)
    before, stream = sys.stdout, os.fdopen(writer, "w", buffering=1)
    sys.stdout = stream
    try:
        yield
    finally:
        sys.stdout = before
        with suppress(BrokenPipeError):
            stream.close()


def run_unread(*words):
    with closed_output():
        return run([str(word) for word in words])


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """With physics, and the diagnosis beside it."""
    out = tmp_path_factory.mktemp("known") / "model.json"
    assert run(["diagnose", str(JOINT), "--out", str(out.with_name("d.json")), "--model-out", str(out)]) == 0
    return out


def test_diagnose_leaves_model_page_and_plan(tmp_path):
    names = {"--out": "d.json", "--model-out": "m.json", "--report": "page.html", "--plan-out": "plan.json"}
    words = [word for option, name in names.items() for word in (option, tmp_path / name)]
    assert run_unread("diagnose", JOINT, *words) == 0
    assert {path.name for path in tmp_path.iterdir()} >= {"d.json", "m.json", "page.html"}


def test_identify_leaves_model_and_exported_arm(tmp_path):
    assert run_unread("identify", JOINT, "--out", tmp_path / "m.json", "--export", "urdf") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.json", "m.urdf"]


@pytest.mark.parametrize("more", [(), ("--verbose",)])
def test_calibrate_leaves_model_diagnosis_and_report(tmp_path, more):
    assert run_unread("calibrate", JOINT, "--out", tmp_path / "c", *more) == 0
    assert sorted(path.name for path in (tmp_path / "c").iterdir()) == ["diagnosis.json", "model.json", "report.html"]


def test_predict_and_compare_leave_their_files(tmp_path, model):
    assert run_unread("predict", model, JOINT / "samples.csv", "--out", tmp_path / "predicted.csv") == 0
    assert run_unread("compare", JOINT, "--simulated-model", model, "--out", tmp_path / "compare.json") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["compare.json", "predicted.csv"]


def test_correct_leaves_the_corrected_poses(tmp_path, model):
    poses = tmp_path / "poses.csv"
    poses.write_text("x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n0.4,0.1,0.4,0,3.1,0\n")
    run_unread("correct", model, poses, "--out", tmp_path / "corrected.csv")
    assert (tmp_path / "corrected.csv").exists()
