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


def write_folder(where, q, positions):
    """A row without a position stands between header and rotations, as where the tracker lost its target."""
    where.mkdir()
    joints = "".join(JOINT.format(a=a, alpha=alpha, d=d) for a, alpha, d in TABLE)
    (where / "rig.toml").write_text(RIG.format(joints=joints))
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
    assert np.max(tool["tool_sigma_m"]) < 10.0 * NOISE_M
    told = capsys.readouterr().out
    assert "point_m = [" in told
    assert f"tool: {out}" in told.replace("\n", "")


def test_axes_are_told_by_joint_and_rows_of_the_file(session, tmp_path):
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
    told = capsys.readouterr().err
    assert "rotations of joint 4 alone and 5 alone are needed" in told
    assert "found single rotations of joint 3 (rows 2-16)" in told
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
