"""Tables of poses: what is read and refused, and where the real tool stands at the commands."""

import csv
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from acquisition.recording import Samples
from calibeam.cli import run
from calibrate.apply.correct.corrected import Options, Wanted, correct
from calibrate.apply.correct.tables import read_poses
from calibrate.apply.predicting import placed
from calibrate.errors import DataError
from calibrate.model.model_file import write_model
from tests.calibrate.apply.correct.six_joints import CHAIN, SIGMA, drawn, inverse, model, postures, real
from tests.calibrate.model.with_effects.two_joints import PLAY_RAD, two_joints

Q = postures(4)
T = drawn().frames(Q)[:, -1]


def wanted(T_base_tool, near_rad, **conditions):
    n, joints = near_rad.shape
    return Wanted(T_base_tool, np.full((n, joints), np.nan), near_rad, conditions)


def test_the_real_tool_reaches_every_pose():
    found = correct(model(), wanted(T, Q), inverse(), Options())
    reached_m = real().frames(found.q_rad)[:, -1, :3, 3]
    assert np.max(np.abs(reached_m - T[:, :3, 3])) < 1e-8
    assert np.allclose(found.before.error_m, np.linalg.norm(real().frames(Q)[:, -1, :3, 3] - T[:, :3, 3], axis=1))
    assert np.all(found.after.s_error_m > 0.1 * SIGMA)
    assert found.status == ("ok",) * 4


def test_a_controller_of_the_rig_file_reaches_the_commands_by_the_corrected_poses():
    found = correct(model(), wanted(T, Q), inverse(), Options())
    q_rad, solved = inverse().refined(drawn(), found.T_base_tool, Q)
    assert solved.all()
    assert np.allclose(q_rad, found.q_rad, atol=1e-9)


def test_what_cannot_be_commanded_is_named_and_not_clipped():
    far, low = T[:1].copy(), Q[:1].copy()
    far[0, :3, 3] *= 10.0
    low[0, 1] = drawn().upper_rad[1] + 0.05
    near = Q[:1].copy()
    near[0, 4] = drawn().upper_rad[4] - 0.005
    poses = np.concatenate([far, drawn().frames(np.concatenate([low, near]))[:, -1]])
    found = correct(model(), wanted(poses, np.concatenate([Q[:1], low, near])), inverse(), Options())
    assert found.status == ("unreachable", "limit", "limit")
    assert np.isnan(found.q_rad[:2]).all()
    assert "joint 2" in found.says[1]
    assert found.says[2].startswith("joint 5 is 0.")
    assert np.isfinite(found.q_rad[2]).all()


def test_a_pose_near_a_singular_posture_is_listed_with_what_its_correction_turns():
    """A straight wrist turns its two outer axes by many degrees, against each other, for a small correction."""
    q = np.repeat(Q[:1], 4, axis=0)
    q[:, 4] = np.radians([0.0, 0.5, 2.0, 20.0])
    found = correct(model(), wanted(drawn().frames(q)[:, -1], q), inverse(), Options())
    assert found.status == ("singular", "singular", "singular", "ok")
    for row in range(3):
        turned_deg = np.degrees(np.abs(found.q_rad[row] - found.nominal_rad[row]))
        joint = int(np.argmax(turned_deg))
        assert joint in (3, 5)
        assert found.says[row] == (
            f"near a singular posture: the correction turns joint {joint + 1} by {turned_deg[joint]:.1f}°"
        )


def test_backlash_is_corrected_by_the_side_that_the_joints_come_from():
    """Two joints in a plane cannot turn freely, so the poses are some of the arm's own."""
    known, q = two_joints(), np.array([[0.3, 0.4], [0.6, 0.9]])
    arm = correct_of_two(known, q, 1)
    other = correct_of_two(known, q, -1)
    assert np.allclose(arm.q_rad[:, 0] - other.q_rad[:, 0], PLAY_RAD, atol=1e-9)  # it trails
    assert np.allclose(arm.via_rad, arm.q_rad - np.radians(2.0))
    for side, found in ((1.0, arm), (-1.0, other)):
        n = len(q)
        columns = {"t_s": np.arange(n, dtype=float), "approach1": np.full(n, side)}
        columns |= {f"q{j + 1}_rad": found.q_rad[:, j] for j in range(2)}
        assert np.allclose(placed(known, Samples(columns, 2)).tip_m, plane(q), atol=1e-9)


def test_without_a_known_side_the_sigma_holds_the_whole_play():
    known, q = two_joints(), np.array([[0.3, 0.4], [0.6, 0.9], [0.9, 0.4]])
    first, *later = correct_of_two(known, q, 0).after.s_error_m
    assert first > 0.5 * PLAY_RAD * 0.3
    assert max(later) < 0.05 * PLAY_RAD


def correct_of_two(known, q, side):
    from acquisition.recording.rig import parse_rig
    from calibeam.motion.motion_inverse import MotionInverse
    from calibrate.model.arms.rig_arm import RigArm

    rig = RigArm.of_rig(parse_rig(known.rig.text, "rig.toml"))
    T = rig.frames(q)[:, -1]
    return correct(known, wanted(T, q), MotionInverse(rig), Options(approach=side))


def plane(q):
    a, b = q[:, 0], q[:, 0] + q[:, 1]
    return np.stack([0.3 * np.cos(a) + 0.2 * np.cos(b), 0.3 * np.sin(a) + 0.2 * np.sin(b), 0.0 * a], axis=1)


FORMS = {
    "rx_rad,ry_rad,rz_rad": lambda R: R.as_rotvec(),
    "a_deg,b_deg,c_deg": lambda R: R.as_euler("ZYX", degrees=True),
    "w_deg,p_deg,r_deg": lambda R: R.as_euler("xyz", degrees=True),
    "qw,qx,qy,qz": lambda R: R.as_quat(scalar_first=True),
}


@pytest.mark.parametrize("columns", FORMS)
def test_every_form_of_an_orientation_is_the_same_pose(columns):
    turned = FORMS[columns]
    numbers = [[*(1e3 * p[:3, 3]).tolist(), *turned(Rotation.from_matrix(p[:3, :3])).tolist()] for p in T]
    rows = [",".join(map(repr, row)) for row in numbers]
    text = "\ufeff" + "\n".join([f"x_mm,y_mm,z_mm,{columns},payload_kg", *(row + ",2.5" for row in rows)])
    read = read_poses(text, "poses.csv", 6, np.eye(4), {"payload_kg": 1.0, "temp_arm_degC": 25.0})
    assert np.allclose(read.T_base_tool, T, atol=1e-12)
    assert {c: v.tolist() for c, v in read.conditions.items()} == {"payload_kg": [2.5] * 4, "temp_arm_degC": [25.0] * 4}


FAULTS = {
    "x_m,y_m,z_m\n0,0,0\n": "an orientation in exactly one",
    "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n0,0,,0,0,0\n": "row 1: z_m is empty",
    "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n0,0,one,0,0,0\n": "row 1 (line 2), z_m",
    "x_m,x_mm,y_m,z_m,rx_rad,ry_rad,rz_rad\n0,0,0,0,0,0,0\n": "x_m or x_mm is given twice",
    "x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,1,1,0,0\n": "have length 1.4142",
    "x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n": "no rows",
    "x_m,y_m,z_m,rx_rad,ry_rad\n0,0,0,0,0\n": "rz_rad or rz_deg is missing",
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_fault_names_its_place(text):
    with pytest.raises(DataError) as fault:
        read_poses(text, "poses.csv", 6, np.eye(4), {})
    assert FAULTS[text] in str(fault.value)


def test_the_command_writes_a_row_for_every_pose_and_ends_as_partial_where_one_has_no_command(tmp_path, capsys):
    write_model(tmp_path / "model.json", model())
    far = [f"{x!r}" for x in (9.0, 0.0, 0.0, 0.0, 0.0, 0.0)]
    near = [repr(x) for x in (*T[0, :3, 3].tolist(), *Rotation.from_matrix(T[0, :3, :3]).as_rotvec().tolist())]
    (tmp_path / "poses.csv").write_text("\n".join(["x_m,y_m,z_m,rx_rad,ry_rad,rz_rad", ",".join(near), ",".join(far)]))
    arguments = ["correct", str(tmp_path / "model.json"), str(tmp_path / "poses.csv"), "--out"]
    assert run([*arguments, str(tmp_path / "c.csv"), "--approach", "negative", "--condition", "payload_kg=2"]) == 3
    printed = capsys.readouterr().out
    assert "1 of 2 poses corrected" in printed
    assert "CHECK" not in printed
    assert "pose 2: unreachable: out of reach of the nominal arm" in printed
    assert "payload_kg is given; no effect of the model depends on it" in printed
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["pose"], row["kind"], row["status"]) for row in rows] == [
        ("1", "approach", "ok"),
        ("1", "pose", "ok"),
        ("2", "pose", "unreachable"),
    ]
    assert rows[2]["q1_rad"] == rows[2]["error_after_m"] == ""
    assert float(rows[0]["q1_rad"]) - float(rows[1]["q1_rad"]) == pytest.approx(np.radians(2.0))
    assert run([*arguments, str(tmp_path / "poses.csv")]) == 1


def test_corrections_larger_than_an_arm_is_off_are_to_be_checked_first(tmp_path, capsys):
    """As with another tool than that of the rig file, or after the mastering was lost: here joint 2 by 2.9 degrees."""
    write_model(tmp_path / "model.json", model(chain={**CHAIN, "joint2.zero": 0.05}))
    row = [*T[0, :3, 3].tolist(), *Rotation.from_matrix(T[0, :3, :3]).as_rotvec().tolist()]
    (tmp_path / "poses.csv").write_text("x_m,y_m,z_m,rx_rad,ry_rad,rz_rad\n" + ",".join(map(repr, row)))
    arguments = ["correct", str(tmp_path / "model.json"), str(tmp_path / "poses.csv"), "--out", str(tmp_path / "c.csv")]
    assert run(arguments) in (0, 3)
    printed = " ".join(capsys.readouterr().out.split())
    assert re.search(r"CHECK BEFORE YOU RUN IT: corrections of up to \d\d mm; check .* --tool", printed)
