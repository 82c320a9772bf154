"""`tool-axes` on session folders: the tool of a concealed truth with its doubt, and what is said without one."""

import csv
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibeam.cli import run

RIG = """schema = 1
name = "five-joints"
[arm]
model = "dh"
{joints}
"""
JOINT = """[[arm.joint]]
a_m = {a}
alpha_rad = {alpha}
d_m = {d}
lower_rad = -2.9
upper_rad = 2.9
"""
TABLE = [(0.0, np.pi / 2, 0.3), (0.4, 0.0, 0.0), (0.1, np.pi / 2, 0.0), (0.0, -np.pi / 2, 0.35), (0.05, 0.0, 0.1)]
HOME = np.array([0.2, -0.9, 0.8, 0.4, -0.3])
POINT = np.array([0.031, -0.012, 0.052])
NOISE_M = 1e-5


def seen(q, rng, target=POINT):
    """Positions of the target in a tracker's own frame, by turning it back through every link."""
    point = np.tile(target, (len(q), 1))
    for j in reversed(range(len(TABLE))):
        a, alpha, d = TABLE[j]
        point = Rotation.from_rotvec([alpha, 0, 0]).apply(point) + np.array([a, 0.0, d])
        point = Rotation.from_rotvec(q[:, j, None] * [0, 0, 1]).apply(point)
    point = Rotation.from_rotvec([0.2, 0.1, 2.0]).apply(point) + np.array([1.0, 2.0, 0.5])
    return point + rng.normal(0.0, NOISE_M, point.shape)


def turned(*joints, span=1.2):
    rows = []
    for joint in joints:
        for angle in np.linspace(-span, span, 15):
            q = HOME.copy()
            q[joint - 1] += angle
            rows.append(q)
    return np.array(rows)


def write_folder(where, q, positions, tolerance=""):
    """A row without a position stands between header and rotations, as where the tracker lost its target."""
    where.mkdir()
    joints = "".join(JOINT.format(a=a, alpha=alpha, d=d) for a, alpha, d in TABLE)
    (where / "rig.toml").write_text(RIG.format(joints=joints) + tolerance)
    with (where / "samples.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["t_s", *(f"q{i + 1}_rad" for i in range(5)), "x_m", "y_m", "z_m"])
        writer.writerow([0, *(HOME + 0.5).tolist(), "", "", ""])
        for i, row in enumerate(q.tolist()):
            writer.writerow([i + 1, *row, *positions[i].tolist()])
    return where


@pytest.fixture
def session(tmp_path):
    def make(*joints, **options):
        q = turned(*joints, **options)
        return write_folder(tmp_path / "session", q, seen(q, np.random.default_rng(3)))

    return make


def test_the_tool_is_found_within_its_sigma_and_the_rig_line_is_said(session, tmp_path, capsys):
    out = tmp_path / "deep" / "tool.json"
    assert run(["tool-axes", str(session(3, 4, 5)), "--out", str(out)]) == 0
    tool = json.loads(out.read_text())
    off = np.array(tool["tool_m"]) - POINT
    assert np.all(np.abs(off) < 4.0 * np.array(tool["tool_sigma_m"]))
    assert np.max(tool["targets"][0]["instrument_sigma_m"]) < 2.0 * NOISE_M
    assert tool["tool_sigma_m"][2] == pytest.approx(3e-4, rel=0.1)  # by the length of the last link, assumed to 0.3 mm
    printed = capsys.readouterr().out
    assert printed.startswith("target determined: yes\ntarget: x 31.")
    assert "joint zeros 3 mrad, lengths 0.3 mm, angles 1 mrad" in printed.replace("\n", "")
    assert "point_m = [" in printed
    assert f"tool: {out}" in printed.replace("\n", "")


def test_axes_are_reported_by_joint_and_rows_of_the_file(session, tmp_path):
    out = tmp_path / "tool.json"
    assert run(["tool-axes", str(session(4, 5)), "--out", str(out)]) == 0
    axes = json.loads(out.read_text())["axes"]
    assert [axis["joint"] for axis in axes] == [4, 5]
    assert axes[0]["rows"] == [2, 16]  # the row without a position is the first
    lever_m = np.hypot(POINT[0] + TABLE[4][0], POINT[1])  # of the target about the last axis
    assert axes[1]["radius_m"] == pytest.approx(lever_m, abs=6.0 * axes[1]["radius_sigma_m"])


def test_json_prints_what_is_in_the_file(session, tmp_path, capsys):
    out = tmp_path / "tool.json"
    assert run(["tool-axes", str(session(4, 5)), "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(out.read_text())


def test_missing_rotations_are_named_and_nothing_is_written(session, tmp_path, capsys):
    out = tmp_path / "tool.json"
    assert run(["tool-axes", str(session(3, 5)), "--out", str(out)]) == 1
    lines = capsys.readouterr().err
    assert "rotations of joint 4 alone and 5 alone are needed" in lines
    assert "found single rotations of joint 3 (rows 2-16)" in lines
    assert not out.exists()


def test_a_target_on_the_last_axis_has_no_circle_to_fit(tmp_path, capsys):
    on_axis = np.array([-TABLE[4][0], 0.0, 0.05])
    q = turned(4, 5)
    folder = write_folder(tmp_path / "session", q, seen(q, np.random.default_rng(3), on_axis))
    assert run(["tool-axes", str(folder), "--out", str(tmp_path / "tool.json")]) == 1
    assert "circle of joint 5, rows 17-31" in capsys.readouterr().err


def test_a_session_without_positions_is_refused(session, tmp_path, capsys):
    folder = session(4, 5)
    lines = (folder / "samples.csv").read_text().splitlines()
    (folder / "samples.csv").write_text("\n".join(",".join(line.split(",")[:6]) for line in lines) + "\n")
    assert run(["tool-axes", str(folder), "--out", str(tmp_path / "tool.json")]) == 1
    assert "no columns x_m, y_m, z_m" in capsys.readouterr().err


def errors_of(folder, out, *options):
    assert run(["tool-axes", str(folder), "--out", str(out), *options]) == 0
    return json.loads(out.read_text())["arm_errors"]


def test_errors_of_the_arm_come_from_options_then_the_rig_file_then_the_default(tmp_path):
    q, out = turned(4, 5), tmp_path / "tool.json"
    tolerance = "[tolerance]\nlength_m = 5e-5\nangle_rad = 2e-4\n"
    folder = write_folder(tmp_path / "session", q, seen(q, np.random.default_rng(3)), tolerance)
    stated = errors_of(folder, out)
    assert (stated["zero_sigma_rad"], stated["length_sigma_m"], stated["angle_sigma_rad"]) == (3e-3, 5e-5, 2e-4)
    assert stated["source"] == "[tolerance] of the rig file, default of an uncalibrated arm"
    given = errors_of(folder, out, "--zero-sigma", "0.1 mrad", "--length-sigma", "0.02 mm")
    assert (given["zero_sigma_rad"], given["length_sigma_m"], given["angle_sigma_rad"]) == (1e-4, 2e-5, 2e-4)
    assert given["source"] == "options, [tolerance] of the rig file"


def test_an_error_of_the_arm_in_another_unit_is_refused(session, tmp_path, capsys):
    assert run(["tool-axes", str(session(4, 5)), "--out", str(tmp_path / "tool.json"), "--zero-sigma", "3 mm"]) == 1
    assert "--zero-sigma: the unit 'mm'" in capsys.readouterr().err


def test_three_targets_in_one_table_give_the_orientation(tmp_path):
    points = dict(enumerate(POINT + np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]), start=1))
    q, rng = turned(4, 5), np.random.default_rng(3)
    folder = write_folder(tmp_path / "session", q, seen(q, rng))
    lines = (folder / "samples.csv").read_text().splitlines()[:1]
    lines[0] += ",target"
    by_target = {k: seen(q, rng, point) for k, point in points.items()}
    for i, row in enumerate(q.tolist()):
        for k, positions in by_target.items():
            lines.append(",".join(map(str, [3 * i + k, *row, *positions[i].tolist(), k])))
    (folder / "samples.csv").write_text("\n".join(lines) + "\n")
    out = tmp_path / "tool.json"
    assert run(["tool-axes", str(folder), "--out", str(out)]) == 0
    tool = json.loads(out.read_text())
    assert [t["target"] for t in tool["targets"]] == [1, 2, 3]
    for target in tool["targets"]:
        off = np.array(target["point_m"]) - points[target["target"]]
        assert np.all(np.abs(off) < 4.0 * np.array(target["sigma_m"]))
    assert np.all(np.abs(tool["orientation"]["rotation_rad"]) < 4.0 * np.array(tool["orientation"]["sigma_rad"]))
    assert tool["orientation"]["frame"] == "origin in target 1, x to target 2, y towards 3"


def test_a_target_that_is_no_whole_number_is_refused_with_its_row(session, tmp_path, capsys):
    folder = session(4, 5)
    lines = (folder / "samples.csv").read_text().splitlines()
    numbers = ["target", *["1"] * (len(lines) - 2), "1.5"]
    joined = "\n".join(f"{line},{number}" for line, number in zip(lines, numbers, strict=True))
    (folder / "samples.csv").write_text(joined + "\n")
    assert run(["tool-axes", str(folder), "--out", str(tmp_path / "tool.json")]) == 1
    assert "column target, row 31: 1.5 is no target; give a whole number" in capsys.readouterr().err


def test_a_calibrated_model_replaces_the_assumed_errors(tmp_path):
    """The arm's zeros are off by 3 mrad; positions at 60 free poses calibrate it, then its wrist is turned."""
    rng = np.random.default_rng(4)
    zeros = np.array([0.0, 3e-3, -2e-3, 3e-3, 0.0])
    free, q = rng.uniform(-1.5, 1.5, (60, 5)), turned(3, 4, 5)
    tolerance = "[tolerance]\nlength_m = 2e-5\nangle_rad = 2e-5\n"
    known = write_folder(tmp_path / "known", free, seen(free + zeros, rng), tolerance)
    folder = write_folder(tmp_path / "session", q, seen(q + zeros, rng), tolerance)
    model, out = tmp_path / "model.json", tmp_path / "tool.json"
    assert run(["identify", str(known), "--out", str(model)]) == 0
    assert run(["tool-axes", str(folder), "--out", str(out)]) == 0
    before = json.loads(out.read_text())
    assert run(["tool-axes", str(folder), "--out", str(out), "--model", str(model)]) == 0
    after = json.loads(out.read_text())
    assert after["arm_errors"]["model"] == "model.json"
    assert after["other_rows_rms_m"] < 0.2 * before["other_rows_rms_m"]
    assert np.all(np.abs(np.array(after["tool_m"]) - POINT) < 4.0 * np.array(after["tool_sigma_m"]))
