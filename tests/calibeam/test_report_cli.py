"""`report`: a page for a recording of any instruments, else one sentence with the right exit code."""

import csv
import json
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.cli import run
from calibeam.commands.report import read_earlier_calibration

RIG = """schema = 1
name = "five-joints"
[arm]
model = "dh"
{joints}
[tool]
point_m = [0.03, 0.01, 0.05]
[noise]
position_m = 1e-5
"""
JOINT = """[[arm.joint]]
a_m = {a}
alpha_rad = {alpha}
d_m = {d}
lower_rad = -2.9
upper_rad = 2.9
"""
pytestmark = pytest.mark.usefixtures("bare_figures")
TABLE = [(0.0, np.pi / 2, 0.3), (0.4, 0.0, 0.0), (0.1, np.pi / 2, 0.0), (0.0, -np.pi / 2, 0.35), (0.05, 0.0, 0.1)]


def seen(q, rng):
    """Positions in a tracker's own frame of an arm 0.3 mm beside its drawing."""
    point = np.tile([0.03, 0.01, 0.05], (len(q), 1))
    for j in reversed(range(len(TABLE))):
        a, alpha, d = TABLE[j]
        point = Rotation.from_rotvec([alpha, 0, 0]).apply(point) + np.array([a + 3e-4, 0.0, d])
        point = Rotation.from_rotvec((q[:, j] + 1e-3 * j)[:, None] * [0, 0, 1]).apply(point)
    point = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1.0, 2.0, 0.5])
    return point + rng.normal(0.0, 1e-5, point.shape)


def write_folder(where, seed, n=90):
    where.mkdir()
    rng = np.random.default_rng(seed)
    joints = "".join(JOINT.format(a=a, alpha=alpha, d=d) for a, alpha, d in TABLE)
    (where / "rig.toml").write_text(RIG.format(joints=joints))
    q = rng.uniform(-2.0, 2.0, (n, 5))
    table = np.column_stack([np.arange(n), q, seen(q, rng)])
    with (where / "samples.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", *(f"q{i + 1}_rad" for i in range(5)), "x_m", "y_m", "z_m"])
        writer.writerows(table.tolist())
    return where


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A session and its model."""
    at = tmp_path_factory.mktemp("made")
    assert run(["identify", str(write_folder(at / "session", 3)), "--out", str(at / "model.json")]) == 0
    return at


@pytest.fixture
def folder(made, tmp_path):
    return shutil.copytree(made / "session", tmp_path / "session")


@pytest.fixture
def model(made, tmp_path):
    """Of that session."""
    (tmp_path / "last-year").mkdir()
    return shutil.copy(made / "model.json", tmp_path / "last-year" / "model.json")


def test_a_session_of_positions_gets_its_report_and_its_model_the_same_one(folder, model, tmp_path, capsys):
    out, anew = tmp_path / "report.html", tmp_path / "deep" / "report.html"
    assert run(["report", str(folder), "--model", str(model), "--out", str(out)]) == 0
    capsys.readouterr()
    assert run(["report", str(folder), "--out", str(anew)]) == 0
    assert f"report: {anew}" in capsys.readouterr().out
    assert out.read_text() == anew.read_text()
    assert "misses positions that the fit has not seen by" in out.read_text()


def test_a_model_by_a_plan_is_read_by_its_plan(folder, tmp_path):
    plan, model, out = tmp_path / "fit.toml", tmp_path / "model.json", tmp_path / "report.html"
    plan.write_text('schema = 1\nmodel = "mdh"\nhold = ["link5.*"]\n')
    assert run(["identify", str(folder), "--plan", str(plan), "--out", str(model)]) == 0
    assert run(["report", str(folder), "--model", str(model), "--out", str(out)]) == 0
    assert "misses positions" in out.read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "lines"),
    [
        (["missing.mcap"], 1, "missing.mcap"),
        (["text.mcap"], 1, "text.mcap"),
        (["session", "--model", "missing.json"], 1, "missing.json: cannot be read"),
        (["session", "--model", "text.mcap"], 1, "text.mcap: not a model.json"),
        (["session", "--modle", "model.json"], 2, "modle"),
        ([], 2, "recording"),
    ],
)
def test_what_cannot_be_reported_is_said_with_its_exit_code(
    folder, tmp_path, capsys, monkeypatch, arguments, code, lines
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.mcap").write_text("nothing of the kind")
    assert run(["report", *arguments]) == code
    said = capsys.readouterr()
    assert lines in (said.err + said.out).lower()
    assert not (tmp_path / "report.html").exists()


def test_the_model_of_another_session_is_refused(folder, tmp_path, capsys):
    other, model = write_folder(tmp_path / "other", 4), tmp_path / "model.json"
    assert run(["identify", str(other), "--out", str(model)]) == 0
    assert run(["report", str(folder), "--model", str(model), "--out", str(tmp_path / "report.html")]) == 1
    assert "give the model of this recording" in capsys.readouterr().err


def test_a_script_reads_verdict_numbers_and_drift_on_one_line(folder, model, tmp_path, capsys):
    """Against the folder of a session, which here is the same one."""
    out = tmp_path / "report.html"
    known = ["--model", str(model), "--against", str(model.parent)]
    assert run(["report", str(folder), *known, "--out", str(out), "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    lines = json.loads(line)
    assert (lines["kind"], lines["report"]) == ("calibeam-report", str(out))
    assert lines["trust"] in ("yes", "with care", "no")
    assert lines["numbers"]["now"]["value"] < 0.2 * lines["numbers"]["as_drawn"]["value"]
    assert "no drift shows" in lines["drift"]
    assert lines["verdict"] in out.read_text()
    assert 'href="#drift"' in out.read_text()


def test_an_earlier_calibration_is_a_model_a_folder_or_a_recording(folder, model):
    by_file, by_folder, by_recording = (read_earlier_calibration(path) for path in (model, model.parent, folder))
    assert by_file.model == by_folder.model
    assert by_recording.model.chain == by_file.model.chain
    assert (by_file.recording, by_folder.recording) == (None, None)
    assert by_recording.recording is not None


def test_an_arm_of_other_joints_is_not_compared(folder, model, tmp_path, capsys):
    lines = json.loads(model.read_text())
    lines["rig"]["text"] = lines["rig"]["text"].replace(JOINT.format(a=0.4, alpha=0.0, d=0.0), "", 1)
    model.write_text(json.dumps(lines))
    assert run(["report", str(folder), "--against", str(model), "--out", str(tmp_path / "r.html")]) == 1
    assert "an arm with 4 joints, this one has 5" in capsys.readouterr().err
