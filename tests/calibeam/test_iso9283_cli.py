"""`calibeam iso9283`: the plan of a pose test, its corrected commands, and the figures of a recording."""

import json

import numpy as np
import pytest
from msgspec.structs import replace

from acquisition.recording.pose_plan import read_pose_plan
from acquisition.recording.rig import load_rig
from acquisition.recording.session_folder import write_csv
from calibeam.cli import run
from calibeam.motion.cube_in_reach import cube_in_reach, ways_to
from calibrate.iso9283.cube import cube_corners_m, cube_poses_m
from calibrate.model.model_file import RigIdentity, write_model
from tests.calibrate.apply.correct.six_joints import drawn

from ..calibrate.iso9283.tracked_six_joints import DRAWN, REAL, RIG_HERE, RIG_TEXT, cycles, known, seen

CUBE = ["--centre-m", "0.4", "0", "0.35", "--edge-m", "0.2"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A plan of 10 cycles, its corrected form, and a session folder of each."""
    folder = tmp_path_factory.mktemp("iso")
    (folder / "rig.toml").write_text(RIG_TEXT)
    write_model(folder / "model.json", known())
    words = ["iso9283", "plan", str(folder / "rig.toml"), "--out", str(folder / "plan.toml"), "--cycles", "10", *CUBE]
    words += ["--model", str(folder / "model.json"), "--corrected", str(folder / "corrected.toml")]
    assert run([*words, "--three-sides"]) == 0
    for name in ("plan", "corrected"):
        poses = read_pose_plan(folder / f"{name}.toml", RIG_HERE).block[0].pose
        q_rad = np.array([pose.q_rad for pose in poses[:51]])  # without the three sides
        number = [pose.repeat or np.nan for pose in poses[:51]]
        off_m = np.random.default_rng(6).normal(0.0, 1e-5, (51, 3))
        (folder / name).mkdir()
        (folder / name / "rig.toml").write_text(RIG_TEXT)
        write_csv(seen(q_rad, number, off_m), folder / name / "samples.csv")
    return folder


def figures(folder, name, *more):
    out = folder / f"{name}.json"
    assert run(["iso9283", "evaluate", str(folder / name), "--out", str(out), *more]) == 0
    return json.loads(out.read_text())


def test_the_plan_holds_the_poses_of_the_cube(folder):
    plan = read_pose_plan(folder / "plan.toml", load_rig(folder / "rig.toml"))
    poses = plan.block[0].pose
    assert len(poses) == 1 + 5 * 10 + 3 * 3 * 10
    assert [pose.repeat for pose in poses[:7]] == [None, *cycles(1), 5]
    assert not any(pose.approach for pose in poses[:51])
    there_m = DRAWN.tip_m(np.array([pose.q_rad for pose in poses[1:6]]))
    wanted = cube_poses_m(np.array([0.4, 0.0, 0.35]), 0.2, "x+")
    assert np.allclose(there_m, wanted[cycles(1) - 1], atol=1e-9)
    table = np.loadtxt(folder / "plan.poses.csv", delimiter=",", skiprows=1)
    assert np.allclose(table[:, :3], wanted, atol=1e-9)


def test_a_plan_without_a_model_asks_nothing_of_a_corrected_one(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "iso9283-corrected.toml").write_text("mine = 1\n")
    assert run(["iso9283", "plan", str(folder / "rig.toml"), "--cycles", "10", *CUBE]) == 0
    assert (tmp_path / "iso9283-corrected.toml").read_text() == "mine = 1\n"


def test_the_corrected_plan_brings_the_real_tool_to_the_poses(folder):
    poses = read_pose_plan(folder / "corrected.toml", RIG_HERE).block[0].pose
    there_m = REAL.tip_m(np.array([pose.q_rad for pose in poses[1:6]]))
    wanted = cube_poses_m(np.array([0.4, 0.0, 0.35]), 0.2, "x+")
    assert np.allclose(there_m, wanted[cycles(1) - 1], atol=1e-8)


def test_figures_before_and_after_correction(folder, capsys):
    before = figures(folder, "plan", "--model", str(folder / "model.json"))
    assert [one["pose"] for one in before["measured"]["poses"]] == [1, 2, 3, 4, 5]
    assert before["formulas"]["AP"].startswith("7.2.1")
    worst = max(one["accuracy_m"]["value"] for one in before["measured"]["poses"])
    assert worst > 5e-4
    printed = capsys.readouterr().out
    assert "with the model's correction: AP 0.0" in printed
    assert "the standard requires 30 cycles" in printed
    assert len(max(printed.splitlines(), key=len)) < 300
    after = figures(folder, "corrected", "--plan", str(folder / "plan.toml"), "--frame", "rig")
    for sent, corrected in zip(after["measured"]["poses"], before["corrected"]["poses"], strict=True):
        assert sent["accuracy_m"]["value"] == pytest.approx(corrected["accuracy_m"]["value"], abs=1e-7)
        assert sent["accuracy_m"]["value"] < 1.5e-5


def test_a_table_with_its_rig_has_the_figures_of_its_session(folder, capsys):
    of_folder = figures(folder, "plan")
    capsys.readouterr()
    table, rig = folder / "lab.csv", str(folder / "rig.toml")
    table.write_bytes((folder / "plan" / "samples.csv").read_bytes())
    assert run(["iso9283", "evaluate", str(table), "--rig", rig, "--out", str(folder / "x.json"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["measured"] == of_folder["measured"]
    assert run(["iso9283", "evaluate", str(table), "--out", str(folder / "x.json")]) == 1
    assert "--rig" in capsys.readouterr().err


def without_joints(folder, name):
    """The table of the plan's session with time, positions and `repeat` alone."""
    lines = [line.split(",") for line in (folder / "plan" / "samples.csv").read_text().splitlines()]
    kept = [i for i, column in enumerate(lines[0]) if column in ("t_s", "x_m", "y_m", "z_m", "repeat")]
    table = folder / f"{name}.csv"
    table.write_text("\n".join(",".join(line[i] for i in kept) for line in lines) + "\n")
    return [f"{name}.csv", "--rig", str(folder / "rig.toml")]


def test_repeatability_asks_for_no_joints(folder, capsys):
    whole, alone = figures(folder, "plan"), figures(folder, *without_joints(folder, "positions"))
    for one, same in zip(whole["measured"]["poses"], alone["measured"]["poses"], strict=True):
        assert same["repeatability_m"] == pytest.approx(one["repeatability_m"])
        assert same["accuracy_m"]["value"] is None
    assert "nan" not in capsys.readouterr().out
    words = ["iso9283", "evaluate", str(folder / "positions.csv"), "--rig", str(folder / "rig.toml")]
    assert run([*words, "--model", str(folder / "model.json"), "--out", str(folder / "x.json")]) == 1
    assert "give --plan" in " ".join(capsys.readouterr().err.split())


def test_a_plan_stands_in_for_joints(folder):
    plan = ["--plan", str(folder / "plan.toml"), "--model", str(folder / "model.json")]
    whole, alone = figures(folder, "plan", *plan), figures(folder, *without_joints(folder, "planned"), *plan)
    for one, same in zip(whole["measured"]["poses"], alone["measured"]["poses"], strict=True):
        assert same["accuracy_m"]["value"] == pytest.approx(one["accuracy_m"]["value"], abs=1e-9)


def test_the_cube_that_is_found_is_in_reach():
    cube = cube_in_reach(RIG_HERE, "x-", np.array([0.38, 0.0, 0.3]))
    corners = cube_corners_m(cube.centre_m, cube.edge_m)
    assert cube.edge_m > 0.15
    assert np.all(np.linalg.norm(corners, axis=1) < 0.8)
    assert np.allclose(DRAWN.tip_m(cube.q_rad), cube.T_base_tool[:, :3, 3], atol=1e-8)


def test_a_model_of_another_arm_is_refused(folder, capsys):
    other = replace(known(), rig=RigIdentity("other", "0" * 64, RIG_TEXT.replace('name = "', 'name = "other-', 1)))
    write_model(folder / "other.json", other)
    words = ["iso9283", "evaluate", str(folder / "plan"), "--out", str(folder / "x.json")]
    assert run([*words, "--model", str(folder / "other.json")]) == 1
    assert "a model of rig 'other-" in " ".join(capsys.readouterr().err.split())


def test_a_cube_out_of_reach_is_refused(folder, capsys):
    words = ["iso9283", "plan", str(folder / "rig.toml"), "--out", str(folder / "no.toml")]
    assert run([*words, "--centre-m", "3", "0", "0"]) == 1
    assert "--centre-m" in capsys.readouterr().err


def test_joints_come_as_they_move_when_the_tool_comes_along_an_axis():
    """With joints 1, 4, 6 at zero the arm is in its plane: only they move the tool sideways."""
    along_x, along_y, along_z = ways_to(RIG_HERE, np.radians([0.0, 30.0, 20.0, 0.0, 40.0, 0.0]))
    assert (along_x[0], along_z[0], along_y[1:3]) == (0, 0, (0, 0))
    q = np.radians([[0.0, 30.0, 20.0, 0.0, 40.0, 0.0]])
    moved = DRAWN.tip_m(q + 1e-3 * np.array([along_y])) - DRAWN.tip_m(q)
    assert moved[0, 1] > 0.0
    assert drawn().n_joints == len(along_x)
