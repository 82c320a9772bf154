"""`calibeam reconcile`: a rig file against a session with a zero error and a soft joint, and against one like it."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import read
from acquisition.recording.rig import rig_text
from calibeam.cli import run
from calibeam.results.comparison import compare
from calibeam.results.reconciliation import reconcile
from calibrate.compare.reconciled_rows import split
from tests.calibeam.test_compare_simulations import EXAMPLES, NOISE_M, TRACKER, arm, session

RIG = EXAMPLES / "rig.toml"
SAMPLES = 140
FEW = 80
ZERO_RAD = 1e-3
TURN_NOISE_RAD = 3e-5
SOFT_RAD_NM = 4e-6
LOAD_NM = 120.0  # of joint 2 with the arm stretched out


def poses(seed=5):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (SAMPLES, 6)) + np.array([0.0, -1.0, 0.5, 0.0, 0.8, 0.0])


def soft(q_rad):
    """Joints as they truly stand: joint 3 off, joint 2 turned by the weight of what lies beyond it."""
    true_q_rad = q_rad.copy()
    true_q_rad[:, 2] += ZERO_RAD
    reach = np.cos(q_rad[:, 1]) + 0.6 * np.cos(q_rad[:, 1] + q_rad[:, 2])
    true_q_rad[:, 1] += SOFT_RAD_NM * LOAD_NM * reach
    return true_q_rad


def reconciled(tmp_path, measured):
    out = tmp_path / "out"
    assert run(["reconcile", str(measured), "--simulation", str(RIG), "--out", str(out)]) == 0
    return json.loads((out / "reconcile.json").read_bytes()), out


@pytest.mark.usefixtures("bare_figures")
def test_a_zero_is_named_and_the_simulation_then_agrees(tmp_path):
    q_rad = poses()[:FEW]
    off_rad = np.array([0.0, 0.0, ZERO_RAD, 0.0, 0.0, 0.0])
    said, out = reconciled(tmp_path, session(tmp_path / "measured", q_rad, q_rad + off_rad, arm()))
    assert [one["where"] for one in said["left_out"]] == ["joint3.angle"]
    (position,) = said["unseen"]
    assert position["rows"] == FEW // 4 == len(said["unseen_rows"])
    assert position["before"] > 5.0
    assert position["after"] < 1.3
    assert said["verdict"] == "agree"
    assert said["seen"] == json.loads((out / "diagnosis.json").read_bytes())["samples"] == FEW - FEW // 4


@pytest.mark.endure
def test_a_soft_joint_and_a_zero_are_named_and_the_simulation_then_agrees(tmp_path, capsys):
    q_rad = poses()
    said, out = reconciled(tmp_path, session(tmp_path / "measured", q_rad, soft(q_rad), arm()))
    named = {(one["where"], one["physics"]) for one in said["left_out"]}
    assert {("joint3.angle", "joint-zero-moved"), ("joint2.angle", "joint-compliance")} <= named
    (position,) = said["unseen"]
    assert position["rows"] == SAMPLES // 4
    assert position["before"] > 5.0
    assert position["geometry"] > position["after"]
    assert position["after"] <= 1.2
    assert said["verdict"] == "agree"
    printed = capsys.readouterr().out.splitlines()
    assert printed[0].startswith("agree")
    assert len(printed) <= 25
    names = ("before.json", "diagnosis.json", "model.json", "simulated.mcap", "after.json", "page.html")
    assert all((out / name).stat().st_size for name in names)
    page = (out / "page.html").read_text(encoding="utf-8")
    assert [page.count(f'id="{anchor}"') for anchor in ("before", "left-out", "after", "remains")] == [1] * 4


@pytest.mark.endure
def test_a_simulation_that_lacks_nothing_agrees_as_it_is(tmp_path):
    said, _ = reconciled(tmp_path, session(tmp_path / "measured", poses(), poses(), arm()))
    assert said["left_out"] == []
    assert said["verdict"] == "agree"
    assert said["unseen"][0]["before"] < 1.3


@pytest.mark.parametrize("rows", [3, 12, 24])
def test_of_few_rows_it_cannot_be_decided_and_a_difference_beyond_the_noise_can(tmp_path, rows):
    q_rad = poses()[:rows]
    said, out = reconciled(tmp_path, session(tmp_path / "measured", q_rad, q_rad, arm()))
    assert said["verdict"] == "undecided"
    (position,) = said["all_rows"]
    assert position["low_m"] < position["stated_m"] < position["high_m"]
    assert {path.name for path in out.iterdir()} == {"page.html", "reconcile.json", "before.json"}


def test_two_rows_do_not_even_place_the_tracker(tmp_path):
    said, out = reconciled(tmp_path, session(tmp_path / "measured", poses()[:2], poses()[:2], arm()))
    assert (said["verdict"], said["all_rows"]) == ("undecided", [])
    assert {path.name for path in out.iterdir()} == {"page.html", "reconcile.json"}


def test_few_rows_that_are_far_off_differ_for_certain(tmp_path):
    q_rad = poses()[:12]
    said, _ = reconciled(tmp_path, session(tmp_path / "measured", q_rad, soft(q_rad), arm()))
    assert (said["verdict"], said["left_out"]) == ("differ", [])
    assert said["all_rows"][0]["low_m"] > 1.3 * said["all_rows"][0]["stated_m"]


def test_a_full_folder_is_one_sentence(tmp_path, capsys):
    few = session(tmp_path / "few", poses()[:12], poses()[:12], arm())
    assert run(["reconcile", str(few), "--simulation", str(RIG), "--out", str(few)]) == 1
    assert "not an empty folder" in capsys.readouterr().err


def turns_rad(q_rad, world):
    """(row, 3) rotation vectors of the flange in the tracker's frame, from where it carries three points."""
    zero, *axes = (arm(POINT_M=np.subtract(at, world.POINT_M)).reflector_m for at in (np.zeros(3), *np.eye(3)))
    frames = np.array([[axis(q) - zero(q) for axis in axes] for q in q_rad]).swapaxes(1, 2)
    noise = Rotation.from_rotvec(np.random.default_rng(1).normal(0.0, TURN_NOISE_RAD, (len(q_rad), 3)))
    return (noise * TRACKER[0].inv() * Rotation.from_matrix(frames)).as_rotvec()


@pytest.mark.usefixtures("bare_figures")
def test_a_target_with_an_orientation_is_reconciled(tmp_path):
    q_rad = poses()[:FEW]
    true_rad = q_rad + np.array([0.0, 0.0, ZERO_RAD, 0.0, 0.0, 0.0])
    turned = dict(zip(("rx_rad", "ry_rad", "rz_rad"), turns_rad(true_rad, arm()).T, strict=True))
    said, _ = reconciled(tmp_path, session(tmp_path / "measured", q_rad, true_rad, arm(), **turned))
    assert said["left_out"][0]["where"] == "joint3.angle"
    (pose,) = said["unseen"]
    assert (pose["instrument"], pose["rows"]) == ("full-pose", FEW // 4)
    assert pose["before"] > 5.0
    assert pose["after"] < 1.3


@pytest.mark.usefixtures("bare_figures")
def test_scatter_far_beyond_the_stated_noise_is_no_agreement(tmp_path):
    q_rad = poses()[:FEW]
    said, _ = reconciled(tmp_path, session(tmp_path / "measured", q_rad, q_rad, arm(), noise_m=4.0 * NOISE_M))
    (position,) = said["unseen"]
    assert position["after"] < 1.3
    assert position["stated_m"] == NOISE_M
    assert said["verdict"] == "differ"


@pytest.mark.endure  # five seconds
def test_few_rows_that_carry_what_remains_are_listed(tmp_path):
    q_rad = poses()[:FEW]
    folder = session(tmp_path / "measured", q_rad, q_rad, arm())
    recording = read(folder)
    _, unseen = split(recording.samples, 0)
    x_m = recording.samples.column("x_m").copy()
    x_m[unseen[0]] += 2e-3
    samples = replace(recording.samples, columns={**recording.samples.columns, "x_m": x_m})
    found = reconcile(replace(recording, samples=samples), rig_text(RIG), "rig.toml").file
    assert found.verdict == "differ"
    assert any(f"without 1 of {FEW // 4} rows, at {unseen[0]}.00 s" in one for one in found.remains)


TARGETS_M = {1: (0.02, 0.0, 0.08), 2: (-0.07, 0.04, 0.06), 3: (0.01, -0.08, 0.07)}
APART_M = 1e-3  # by which target 2 truly sits beside its drawing


def of_three_targets(folder, poses_rad):
    """Every pose read at three targets; `[tool] point_m` is none of them."""
    worlds = {k: arm(POINT_M=np.subtract(point, arm().POINT_M)) for k, point in TARGETS_M.items()}
    worlds[2].POINT_M[2] += APART_M
    q_rad = np.repeat(poses_rad, 3, axis=0)
    named = np.resize([1, 2, 3], len(q_rad))
    rig = RIG.read_text(encoding="utf-8").replace("point_m = [0.02, 0.0, 0.08]", "")
    rig += "".join(f"\n[[target]]\nid = {k}\npoint_m = {list(point)}\n" for k, point in TARGETS_M.items())
    ways = iter(named.tolist())
    world = SimpleNamespace(reflector_m=lambda q: worlds[next(ways)].reflector_m(q))
    return session(folder, q_rad, q_rad, world, rig=rig, target=named)


@pytest.mark.usefixtures("bare_figures")
def test_every_target_is_replayed_and_compared_at_its_own_point(tmp_path):
    folder, out = of_three_targets(tmp_path / "measured", poses()[:30]), tmp_path / "out"
    assert run(["reconcile", str(folder), "--simulation", str(folder / "rig.toml"), "--out", str(out)]) == 0
    said = json.loads((out / "reconcile.json").read_bytes())
    assert [one["where"] for one in said["left_out"]] == ["tool.point 2"]
    (position,) = said["unseen"]
    assert position["before_m"] > 0.1 * APART_M
    assert position["after"] < 1.3
    assert said["verdict"] == "agree"


@pytest.mark.usefixtures("bare_figures")
def test_geometry_alone_keeps_the_physics_that_the_simulation_has(tmp_path):
    q_rad = poses()
    zero_rad = np.array([0.0, 0.0, ZERO_RAD, 0.0, 0.0, 0.0])
    measured = session(tmp_path / "measured", q_rad, soft(q_rad), arm())
    simulated = session(tmp_path / "simulated", q_rad, soft(q_rad) - zero_rad, arm(), seed=3)
    out = tmp_path / "out"
    assert run(["reconcile", str(measured), "--simulation", str(simulated), "--out", str(out)]) == 0
    said = json.loads((out / "reconcile.json").read_bytes())
    assert [(one["where"], one["physics"]) for one in said["left_out"]] == [("joint3.angle", "joint-zero-moved")]
    (position,) = said["unseen"]
    assert position["before"] > 5.0
    assert position["geometry"] < 1.6  # both recordings scatter


def test_a_session_of_several_targets_does_not_differ_from_itself(tmp_path):
    recording = read(of_three_targets(tmp_path / "measured", poses()[:20]))
    assert compare(recording, recording).verdict == "consistent"
