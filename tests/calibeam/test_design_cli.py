"""`calibeam design` and `calibeam simulate-errors` as a script sees them."""

import json
from pathlib import Path

import pytest

from acquisition.recording.pose_plan import read_pose_plan
from acquisition.recording.rig import load_rig
from calibeam.cli import run
from calibeam.motion import reachable_poses

RIGS = Path(__file__).parents[2] / "rigs"
ROBOT, ARM = RIGS / "ur5e-dual-psd.toml", RIGS / "arm-cmm-reference.toml"


@pytest.mark.usefixtures("bare_figures")
def test_a_design_leaves_a_plan_a_page_and_figures(tmp_path, capsys):
    plan, page = tmp_path / "plan.toml", tmp_path / "design.html"
    options = ["--poses", "24", "--repeats", "3", "--candidates", "8", "--out", str(plan), "--report", str(page)]
    assert run(["design", str(ROBOT), *options, "--json"]) == 0
    lines = json.loads(capsys.readouterr().out)
    assert read_pose_plan(plan, load_rig(ROBOT)).poses == 24
    assert lines["free_space_m"] < lines["random_free_space_m"]
    assert lines["smallest"][0]["value"] > 0.0
    assert len(lines["isolability"]["r2"]) == len(lines["isolability"]["terms"])
    assert "Design of a session" in page.read_text(encoding="utf-8")


def test_a_design_says_what_it_promises(tmp_path, capsys):
    options = ["--poses", "12", "--repeats", "2", "--candidates", "4", "--out", str(tmp_path / "plan.toml")]
    assert run(["design", str(ROBOT), *options]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "predicted error over the workspace (the beam" in said
    assert "causes that a diagnosis of this plan would find" in said


@pytest.mark.endure  # daily: of a small arm, below
def test_errors_of_the_reference_arm_leave_a_folder(tmp_path, capsys):
    errors = ["--errors", str(RIGS / "errors" / "arm-cmm.toml"), "--arms", "20000", "--poses", "3"]
    errors += ["--only", "link*.x", "joint*.zero", "joint3.*", "heat.arm"]
    assert run(["simulate-errors", str(ARM), *errors, "--out", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "worst posture" in said
    lines = json.loads((tmp_path / "errors.json").read_text())
    for pose in lines["poses"]:
        assert pose["drawn_rms_m"] == pytest.approx(pose["linear_rms_m"], rel=0.02)
    assert sum(line["share"] for line in lines["budget"]) == pytest.approx(1.0)
    assert {path.suffix for path in tmp_path.iterdir()} == {".json", ".html", ".svg"}


def test_a_robot_is_simulated_the_same_with_any_number_of_workers(capsys):
    lines = []
    for workers in ("1", "2"):
        options = ["--only", "link2.*", "joint*.zero", "--arms", "10000", "--poses", "2", "--workers", workers]
        assert run(["simulate-errors", str(ROBOT), *options, "--json"]) == 0
        lines.append(json.loads(capsys.readouterr().out))
    assert lines[0] == lines[1]
    assert len(lines[0]["sources"]) == 12


def test_an_error_that_moves_nothing_has_no_worst_posture_and_no_share(tmp_path, capsys):
    """The reference arm's ball is the origin of its last frame: a turn of that frame does nothing."""
    options = ["--only", "link6.roll", "--arms", "1000", "--poses", "2", "--out", str(tmp_path)]
    assert run(["simulate-errors", str(ARM), *options]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no worst posture: none of these errors moves the probe" in said
    assert "Sobol indices over 6 of them" in said
    lines = json.loads((tmp_path / "errors.json").read_text())
    assert (lines["worst"], lines["sobol_poses"]) == ([], 6)
    assert (lines["sources"][0]["share_first"], lines["sources"][0]["share_total"]) == (0.0, 0.0)


def test_errors_without_a_size_are_refused(capsys):
    assert run(["simulate-errors", str(ROBOT), "--only", "heat.*"]) == 1
    assert "no error to simulate" in " ".join(capsys.readouterr().err.split())


def test_a_design_of_places_out_of_reach_gives_up_after_a_stated_number_of_tries(tmp_path, capsys, monkeypatch):
    tried = []

    def none(*_):
        tried.append(1)
        return []

    monkeypatch.setattr(reachable_poses, "all_solutions", none)
    far = tmp_path / "rig.toml"
    far.write_text(ROBOT.read_text().replace("d_m = 0.1625", "d_m = 19.0", 1))
    places = len(load_rig(far).placements)
    assert run(["design", str(far), "--out", str(tmp_path / "plan.toml")]) == 1
    assert len(tried) == 2 * places * reachable_poses.FUTILE  # each place, with either face first
    assert "no pose lights both faces at any place; check placements" in capsys.readouterr().err


def test_errors_of_a_rig_with_an_endless_name_are_refused(tmp_path, capsys):
    named = tmp_path / "rig.toml"
    for length in (10**6, 10**7):
        named.write_text(ARM.read_text().replace('name = "', 'name = "' + "x" * length, 1))
        assert run(["simulate-errors", str(named), "--arms", "10", "--poses", "1"]) == 1
        assert len(capsys.readouterr().err.replace(str(tmp_path), ".").strip()) <= 300 + len("error: ")
