"""`identify` and `predict` on session folders: a model that predicts by itself, and blunders told to the person."""

import csv
import io
import json
import shutil
from contextlib import redirect_stdout
from functools import partial
from importlib import import_module

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import read
from calibeam.cli import run
from calibrate.fit.solvers import solve
from calibrate.model.model_file import read_model
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.evidence.session_verdict import session_verdict

RIG = """schema = 1
name = "three-joints"
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
TABLE = [(0.0, np.pi / 2, 0.3), (0.4, 0.0, 0.0), (0.1, np.pi / 2, 0.0), (0.0, -np.pi / 2, 0.35), (0.05, 0.0, 0.1)]
POSITION = ("x_m", "y_m", "z_m")
POINT = np.array([0.0302, 0.0101, 0.0498])


def observed(q, rng):
    """Positions of an arm 0.3 mm beside its drawing, in a tracker frame of its own."""
    point = np.tile(POINT, (len(q), 1))
    for j in reversed(range(len(TABLE))):
        a, alpha, d = TABLE[j]
        point = Rotation.from_rotvec([alpha, 0, 0]).apply(point) + np.array([a + 3e-4, 0.0, d])
        point = Rotation.from_rotvec((q[:, j] + 1e-3 * j)[:, None] * [0, 0, 1]).apply(point)
    seen = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1.0, 2.0, 0.5])
    return seen + rng.normal(0.0, 1e-5, point.shape)


def write_samples(path, q, positions=None):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        seen = () if positions is None else POSITION
        writer.writerow(["t_s", *(f"q{i + 1}_rad" for i in range(5)), *seen])
        for i, row in enumerate(q.tolist()):
            writer.writerow([i, *row, *([] if positions is None else positions[i].tolist())])


def written(where):
    rng = np.random.default_rng(3)
    joints = "".join(JOINT.format(a=a, alpha=alpha, d=d) for a, alpha, d in TABLE)
    where.mkdir()
    (where / "rig.toml").write_text(RIG.format(joints=joints))
    q = rng.uniform(-2.0, 2.0, (90, 5))
    write_samples(where / "samples.csv", q, observed(q, rng))
    return where


@pytest.fixture
def folder(tmp_path):
    return written(tmp_path / "session")


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    """A folder with model.json of that session, its arm beside it, and what was printed."""
    at, words = tmp_path_factory.mktemp("identified"), io.StringIO()
    with redirect_stdout(words):
        done = run(["identify", str(written(at / "session")), "--out", str(at / "model.json"), "--export", "urdf"])
    assert done == 0
    return at, " ".join(words.getvalue().split())


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_a_session_folder_becomes_a_model_that_predicts_unseen_poses_by_itself(
    identified, tmp_path, monkeypatch, request
):
    model, out = tmp_path / "model.json", tmp_path / "predicted.csv"
    shutil.copy(identified[0] / "model.json", model)
    monkeypatch.chdir(tmp_path)
    (identified[0] / "session").rename(away := identified[0] / "elsewhere")  # a model holds all that it needs
    request.addfinalizer(lambda: away.rename(identified[0] / "session"))
    assert "unseen rows (random 20% of the rows): " in identified[1]
    rng = np.random.default_rng(9)
    q = rng.uniform(-2.0, 2.0, (30, 5))
    seen = observed(q, rng)
    write_samples(tmp_path / "new.csv", q, seen)
    assert run(["predict", str(model), str(tmp_path / "new.csv"), "--out", str(out)]) == 0
    predicted = rows(out)
    assert list(predicted[0]) == [
        "t_s",
        *POSITION,
        *(f"s_{c}" for c in POSITION),
        *(f"r_{c}" for c in POSITION),
        "outside",
    ]
    found = np.array([[float(row[c]) for c in POSITION] for row in predicted])
    residual = np.array([[float(row[f"r_{c}"]) for c in POSITION] for row in predicted])
    assert np.sqrt(np.mean((found - seen) ** 2)) < 2e-5
    np.testing.assert_allclose(residual, found - seen, atol=1e-12)


def test_samples_without_observations_are_predicted_too(folder, tmp_path, capsys):
    model, out = tmp_path / "deep" / "model.json", tmp_path / "predicted.csv"
    assert run(["identify", str(folder), "--out", str(model), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(model.read_text())  # one line for scripts
    write_samples(tmp_path / "new.csv", np.zeros((4, 5)))
    assert run(["predict", str(model), str(tmp_path / "new.csv"), "--out", str(out)]) == 0
    assert [list(row) for row in rows(out)] == [["t_s", *POSITION, *(f"s_{c}" for c in POSITION), "outside"]] * 4


def test_the_arm_is_exported_next_to_the_model_of_a_session(identified):
    assert "rad" in (identified[0] / "model.urdf").read_text()


@pytest.mark.endure  # daily: as URDF, above; the other forms are those of `export-model`
@pytest.mark.parametrize(("form", "suffix"), [("dh-csv", ".dh.csv"), ("matlab", ".m")])
def test_the_arm_is_exported_next_to_the_model(folder, tmp_path, form, suffix):
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json"), "--export", form]) == 0
    assert "rad" in (tmp_path / f"model{suffix}").read_text()


def test_a_bad_row_is_reported_and_stands_in_the_model(folder, tmp_path, capsys):
    table = (folder / "samples.csv").read_text().splitlines()
    cells = table[8].split(",")
    cells[7] = str(float(cells[7]) + 0.1)
    table[8] = ",".join(cells)
    (folder / "samples.csv").write_text("\n".join(table) + "\n")
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 0
    assert "left out: row 8, y_m: reads" in capsys.readouterr().out.replace("\n", " ")
    (gross_error,) = json.loads((tmp_path / "model.json").read_text())["blunders"]
    assert (gross_error["kind"], gross_error["rows"], gross_error["column"]) == ("WRONG_VALUE", [8], "y_m")


def test_a_file_in_degrees_fails_with_one_sentence(folder, tmp_path, capsys):
    table = rows(folder / "samples.csv")
    q = np.degrees([[float(row[f"q{i}_rad"]) for i in range(1, 6)] for row in table])
    write_samples(folder / "samples.csv", q, np.array([[float(row[c]) for c in POSITION] for row in table]))
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 1
    assert "these are degrees; write radians" in capsys.readouterr().err
    assert not (tmp_path / "model.json").exists()


def test_a_plan_in_another_arm_model_predicts_by_its_model_file_alone(folder, tmp_path, capsys):
    plan, model, out = tmp_path / "fit.toml", tmp_path / "model.json", tmp_path / "predicted.csv"
    plan.write_text('schema = 1\nmodel = "local-poe"\nloss = "huber"\nsplits = ["last"]\n')
    assert (
        run(["identify", str(folder), "--plan", str(plan), "--bootstrap", "8", "--out", str(model), "--verbose"]) == 0
    )
    printed = capsys.readouterr().out
    assert "held out (last 20% of the session): position" in printed
    assert "random" not in printed
    assert "bootstrap: 8 refits" in printed
    content = json.loads(model.read_text())
    assert (content["arm_model"], content["plan"]) == ("local-poe", plan.read_text())
    assert content["bootstrap"] == {"rounds": 8, "failed": 0}
    assert {p["split"] for p in content["proofs"]} == {"last 20% of the session"}
    assert content["free_space"]["rms_m"] < content["free_space"]["pose_rms_m"]
    lines = [p for p in content["parameters"] if p["value"] is not None]
    assert all(p["low"] < p["value"] < p["high"] and p["bootstrap_sigma"] > 0.0 for p in lines)
    q = np.random.default_rng(9).uniform(-2.0, 2.0, (30, 5))
    seen = observed(q, np.random.default_rng(8))
    write_samples(tmp_path / "new.csv", q, seen)
    assert run(["predict", str(model), str(tmp_path / "new.csv"), "--out", str(out)]) == 0
    residual = np.array([[float(row[f"r_{c}"]) for c in POSITION] for row in rows(out)])
    assert np.sqrt(np.mean(residual**2)) < 2e-5


def test_zeros_that_free_links_hide_have_an_option_that_finds_them(folder, tmp_path, capsys):
    plan, model, hint = tmp_path / "fit.toml", tmp_path / "model.json", "--zeros-only"
    plan.write_text('schema = 1\nmodel = "local-poe"\n')
    assert run(["identify", str(folder), "--plan", str(plan), "--out", str(model)]) == 0
    free = capsys.readouterr().out
    assert hint in free
    assert run(["identify", str(folder), hint, "--out", str(model)]) == 0
    held = capsys.readouterr().out
    assert hint not in held
    assert held.count(" zero ") > free.count(" zero ")


def test_a_fault_in_the_plan_is_one_sentence(folder, tmp_path, capsys):
    plan = tmp_path / "fit.toml"
    plan.write_text('schema = 1\nlose = "huber"\n')
    assert run(["identify", str(folder), "--plan", str(plan), "--out", str(tmp_path / "model.json")]) == 1
    error = " ".join(capsys.readouterr().err.split())
    assert "fit.toml line 2: unknown key 'lose' in the file; did you mean 'loss'?" in error


def test_noise_that_was_stated_too_small_is_an_alarm_on_screen_and_in_the_model(folder, tmp_path, capsys):
    rig = folder / "rig.toml"
    rig.write_text(rig.read_text().replace("position_m = 1e-5", "position_m = 1e-6"))
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 0
    assert "ALARM: misfit is larger than the stated noise" in capsys.readouterr().out
    (alarm,) = json.loads((tmp_path / "model.json").read_text())["alarms"]
    assert "times the stated noise" in alarm


@pytest.mark.parametrize(
    ("line", "old", "new", "says"),
    [
        (0, "q2_rad", "q1_rad", "column 'q1_rad' stands twice"),
        (0, "q5_rad", "q6_rad", "column 'q5_rad': the column is missing"),
        (3, ",", ",x", "row 3 (line 4), column 'q1_rad': 'x"),
        (3, ",", ",nan,", "row 3 (line 4): 10 cells under 9 columns"),
    ],
)
def test_what_the_format_promises_to_refuse_names_file_row_and_column(folder, tmp_path, capsys, line, old, new, says):
    table = (folder / "samples.csv").read_text().splitlines()
    table[line] = table[line].replace(old, new, 1)
    (folder / "samples.csv").write_text("\n".join(table) + "\n")
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 1
    lines = capsys.readouterr().err
    assert f"{folder / 'samples.csv'}" in lines
    assert says in lines


def test_where_nothing_is_determined_the_command_fails_and_writes_no_model(folder, tmp_path, capsys):
    table = (folder / "samples.csv").read_text().splitlines()
    (folder / "samples.csv").write_text("\n".join(table[:4]) + "\n")
    assert run(["identify", str(folder), "--out", str(tmp_path / "model.json")]) == 1
    assert f"{folder}: nothing can be identified: none of" in capsys.readouterr().err
    assert not (tmp_path / "model.json").exists()


def test_the_first_word_is_the_report_s_verdict_and_no_alarming_status(identified):
    at, lines = identified
    judged = session_verdict(session_evidence(read(at / "session"), read_model(at / "model.json")))
    assert lines.startswith(" ".join(" ".join([judged.sentence, *judged.reasons]).split()))
    assert "RANK_DEFICIENT" not in lines


@pytest.mark.parametrize("instrument", ["position", "distance"])
def test_every_way_to_read_positions_ends_with_a_verdict(folder, tmp_path, capsys, instrument):
    plan = tmp_path / "fit.toml"
    plan.write_text(f'schema = 1\ninstruments = ["{instrument}"]\n')
    assert run(["identify", str(folder), "--plan", str(plan), "--out", str(tmp_path / "model.json")]) == 0
    assert f"misses {instrument}s that the fit has not seen by" in " ".join(capsys.readouterr().out.split())


def test_a_fit_that_came_to_no_end_is_partial_and_its_model_is_kept(folder, tmp_path, capsys, monkeypatch):
    model = tmp_path / "model.json"
    monkeypatch.setattr(import_module("calibrate.fit.solvers.solve"), "solve", partial(solve, max_steps=0))
    assert run(["identify", str(folder), "--out", str(model)]) == 3
    lines = capsys.readouterr()
    assert "No usable model: step limit reached" in " ".join(lines.out.split())
    assert f"what was found so far is in {model}" in " ".join(lines.err.split())
    assert read_model(model).status == "OUT_OF_STEPS"


def test_a_refit_that_came_to_no_end_is_partial_and_its_model_is_kept(identified, tmp_path, capsys, monkeypatch):
    known, model = identified[0] / "model.json", tmp_path / "model.json"
    refit = ["identify", str(identified[0] / "session"), "--model", str(known), "--out", str(model)]
    assert run(refit) == 0
    assert read_model(model).status == read_model(known).status == "RANK_DEFICIENT"
    monkeypatch.setattr("calibrate.diagnose.limits.FIT_TURNS", 2)
    capsys.readouterr()
    assert run(refit) == 3
    said = f"kmax of [dog-leg] in the fit plan; what was found so far is in {model}"
    assert said in " ".join(capsys.readouterr().err.split())
    assert (read_model(model).status, read_model(model).fit.ended_by) == ("OUT_OF_STEPS", "ROUNDS")


def test_the_rule_that_ended_a_fit_and_its_iterations_are_on_the_screen_and_in_the_report(
    folder, tmp_path, capsys, bare_figures
):
    plan, model, page = tmp_path / "fit.toml", tmp_path / "model.json", tmp_path / "report.html"
    plan.write_text('schema = 1\nshare = 0\nsolver = "dog-leg"\n[dog-leg]\nkmax = 2\ne1 = 0\ne2 = 0\ne3 = 0\n')
    run(["identify", str(folder), "--plan", str(plan), "--out", str(model), "--verbose"])
    lines = " ".join(capsys.readouterr().out.split())
    iterations = read_model(model).fit.iterations
    assert f"fit by dog-leg, least-squares: {iterations} iterations in all rounds, ended by STEPS" in lines
    assert "kmax" in lines
    run(["report", str(folder), "--model", str(model), "--out", str(page)])
    assert "Fit by dog-leg, least-squares" in page.read_text()
    assert "ended by STEPS" in page.read_text()
