"""`check` names the arm that a controller computes with, where it is not that of the rig file, and writes it."""

import json
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from calibeam.cli import run
from calibeam.results.controller_findings import controller_notes
from calibrate.model.arms.rig_arm import RigArm
from simulators.ur.controller_kinematics import Link, NominalArm, frame_of, pose_of

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
TOOL = (0.0, 0.0, 0.12, 0.0, 0.0, 0.3)
NONE = (0.0,) * 6
LENGTHENED_M = 5e-4


class Standing:
    def now_s(self) -> float:
        return 1000.0


def controller(lengthened_m=0.0):
    """As the emulated controller computes; link 2 longer than in the rig file."""
    joints = load_rig(RIG).arm.joints
    rows = [Link(j.a_m or 0.0, j.alpha_rad or 0.0, j.d_m or 0.0, j.theta_offset_rad or 0.0) for j in joints]
    rows[1] = Link(rows[1].a_m + lengthened_m, *(rows[1].alpha_rad, rows[1].d_m, rows[1].theta_offset_rad))
    return NominalArm(rows)


@pytest.fixture
def recorded(tmp_path):
    """A robot's stream as the RTDE driver declares it, along a path through the room."""

    def made(arm, tool=NONE, samples=1500, name="recording.mcap", rig=RIG, joints=range(6), stated=True):
        t = np.linspace(0.0, 1.0, samples)[:, None]
        q = np.sin(2.0 * np.pi * t * np.array([1.0, 2.0, 3.0, 5.0, 7.0, 11.0]) + np.arange(6)) - [0, 1, 0, 1, 0, 0]
        q[:, [j for j in range(6) if j not in joints]] = 0.4
        poses = np.array([pose_of(arm.tool(row.tolist(), frame_of(tool))) for row in q])
        channels = (
            Channel("actual_q_rad", "rad", (6,)),
            Channel("actual_tcp_pose_m_rad", "m, rad", (6,)),
            Channel("tcp_offset_m_rad", "m, rad", (6,)),
        )
        path, number = tmp_path / name, np.arange(samples)
        with RecordingWriter(
            path, rig_text=rig_text(rig), software="test", clock=Standing(), notes={"segment": "1"}
        ) as writer:
            values = {
                "actual_q_rad": q,
                "actual_tcp_pose_m_rad": poses,
                "tcp_offset_m_rad": np.tile(tool, (samples, 1)),
            }
            kept = channels if stated else channels[:2]
            values = {channel.name: values[channel.name] for channel in kept}
            writer.stream("robot", kept).append(1000.0 + number * 2e-3, number * 2e-3, number, values)
        return path, q

    return made


def findings(path, capsys, *more):
    assert run(["check", str(path), "--json", *more]) == 0
    return [f for f in json.loads(capsys.readouterr().out)["findings"] if f["problem"] == "controller-arm"]


def test_the_same_arm_is_not_reported(recorded, capsys):
    assert findings(recorded(controller())[0], capsys) == []


def test_another_tool_is_information(recorded, capsys):
    path, _ = recorded(controller(), TOOL)
    (found,) = findings(path, capsys)
    assert found["severity"] == "information"
    assert (
        "the arm of the rig file, but with another tool: its tool is stated by it at 0.000, 0.000, 120.000 mm"
        in found["says"]
    )
    assert controller_notes(read(path)) == ()


ERROR = (0.04, 0.0, 0.0, 0.0, 0.0, 0.0)  # of a tool, 40 mm
ARM = "arm of the controller"


def ending(path, capsys):
    """What `check` prints, and the record of this examination."""
    assert run(["check", str(path)]) == 0
    shown = capsys.readouterr().out.replace("\N{NO-BREAK SPACE}", " ")
    assert run(["check", str(path), "--json"]) == 0
    (one,) = (e for e in json.loads(capsys.readouterr().out)["examinations"] if e["what"] == ARM)
    return shown, one


def test_a_tool_that_the_controller_does_not_state_is_printed_with_sigma(recorded, capsys):
    shown, one = ending(recorded(controller(), ERROR, stated=False)[0], capsys)
    assert "with another tool: its tool is at 40.0000000 ± 0.0000010 mm, " in shown
    assert "not determined" not in shown
    assert one["outcome"] == "found"


def test_poses_about_one_axis_leave_the_tool_not_determined(recorded, capsys):
    shown, one = ending(recorded(controller(), ERROR, joints=[5], stated=False)[0], capsys)
    assert "the place of its tool is not determined" in shown
    assert "about two axes that are not parallel" in shown
    assert one["outcome"] == "found"


@pytest.mark.parametrize("poses", [4, 8])
def test_few_poses_are_not_examined_and_not_without_errors(recorded, capsys, poses):
    shown, one = ending(recorded(controller(), ERROR, samples=poses, stated=False)[0], capsys)
    assert (one["outcome"], one["expected"], one["where"]) == ("not examined", True, "stream robot")
    assert one["reason"] == f"{poses} different poses of the controller's tool, fewer than 20"
    assert "in 20 or more different poses" in one["remedy"]
    assert f"not examined: {ARM} (stream robot): {one['reason']}; {one['remedy']}" in shown
    assert "nothing wrong in what was examined: " in shown
    assert "no errors" not in shown


def test_another_arm_is_named_and_written(recorded, tmp_path, capsys):
    path, q = recorded(controller(LENGTHENED_M), TOOL)
    (found,) = findings(path, capsys, "--controller-arm", str(tmp_path / "arm.toml"))
    assert found["severity"] == "warning"
    assert "another arm than the rig file: link2.length 500.0" in found["says"]
    assert controller_notes(read(path)) == (found["says"],)
    written = RigArm.of_rig(load_rig(tmp_path / "arm.toml"))
    other = np.random.default_rng(1).uniform(-2.5, 2.5, (20, 6))
    true = [controller(LENGTHENED_M).tool(row.tolist(), frame_of(TOOL))[9:] for row in other]
    assert np.abs(written.tip_m(other) - true).max() < 1e-8
    assert np.abs(RigArm.of_rig(load_rig(RIG)).frames(q)[:, -1] - written.frames(q)[:, -1]).max() > 1e-4


def test_poses_of_other_angles_show_no_arm(recorded, tmp_path, capsys, monkeypatch):
    arm = controller()
    monkeypatch.setattr(arm, "tool", lambda q, tool: NominalArm.tool(arm, q[::-1], tool))
    path, _ = recorded(arm)
    (found,) = findings(path, capsys)
    assert found["severity"] == "information"
    assert "do not belong to the joint angles beside them" in found["says"]
    assert run(["check", str(path), "--controller-arm", str(tmp_path / "arm.toml")]) == 1
    assert not (tmp_path / "arm.toml").exists()


def test_a_recording_without_its_poses_is_refused(recorded, tmp_path, capsys):
    path, _ = recorded(controller(), samples=10)
    assert run(["check", str(path), "--controller-arm", str(tmp_path / "arm.toml")]) == 1
    assert "does not show the controller's arm" in capsys.readouterr().err
    assert run(["check", str(RIG), "--controller-arm", str(tmp_path / "arm.toml")]) == 1
    assert "is a rig file; give a recording" in capsys.readouterr().err
    assert not (tmp_path / "arm.toml").exists()


def test_columns_of_a_table_are_imported_and_are_no_cause_of_errors(tmp_path):
    """KUKA: degrees and millimetres; A, B, C about z, y', x''."""
    from calibrate.model.effects.conditions import conditions_of

    rng = np.random.default_rng(2)
    q = rng.uniform(-1.5, 1.5, (40, 6))
    poses = np.array([controller().tool(row.tolist(), frame_of(NONE)) for row in q])
    R = poses[:, :9].reshape(-1, 3, 3).swapaxes(1, 2)
    a, c = np.arctan2(R[:, 1, 0], R[:, 0, 0]), np.arctan2(R[:, 2, 1], R[:, 2, 2])
    abc = np.degrees(np.stack([a, np.arcsin(-R[:, 2, 0]), c], axis=1))
    table = np.concatenate([np.degrees(q), 1e3 * poses[:, 9:], abc, 1e3 * poses[:, 9:]], axis=1)
    heads = [*(f"A{j}" for j in range(1, 7)), "X", "Y", "Z", "A", "B", "C", "TX", "TY", "TZ"]
    np.savetxt(tmp_path / "kuka.csv", table, delimiter=",", header=",".join(heads), comments="", fmt="%.9f")
    stated = (
        "A1..A6 [deg] = q, X Y Z [mm] = controller-position, A B C [deg] = controller-abc, TX TY TZ [mm] = position"
    )
    (tmp_path / "rig.toml").write_text(rig_text(Path(str(RIG).replace("dual-psd", "tracker"))), encoding="utf-8")
    rig, out = str(tmp_path / "rig.toml"), str(tmp_path / "session")
    assert run(["import", str(tmp_path / "kuka.csv"), "--rig", rig, "--out", out, "--columns", stated, "--yes"]) == 0
    samples = read(tmp_path / "session").samples
    assert not any(name.startswith("controller") for name in conditions_of(samples, {}).extra)
    assert np.allclose(samples.column("controller_x_m"), poses[:, 9], atol=1e-9)
    assert controller_notes(read(tmp_path / "session")) == ()


def test_segments_of_one_robot_show_one_arm(recorded, tmp_path):
    (tmp_path / "log").mkdir()
    for number, tool in enumerate((TOOL, NONE), start=1):
        recorded(controller(LENGTHENED_M), tool, name=f"log/segment-000{number}.mcap")
    assert run(["check", str(tmp_path / "log"), "--controller-arm", str(tmp_path / "arm.toml")]) == 0
    written = RigArm.of_rig(load_rig(tmp_path / "arm.toml"))
    q = np.random.default_rng(2).uniform(-2.5, 2.5, (20, 6))
    true = [controller(LENGTHENED_M).forward(row.tolist())[0][9:] for row in q]
    assert np.abs(written.frames(q)[:, -1, :3, 3] - true).max() < 1e-8


def test_segments_of_two_rig_files_are_refused(recorded, tmp_path, capsys):
    (tmp_path / "log").mkdir()
    (tmp_path / "other.toml").write_text(rig_text(RIG) + "\n# another\n")
    recorded(controller(), TOOL, name="log/segment-0001.mcap")
    recorded(controller(), TOOL, name="log/segment-0002.mcap", rig=tmp_path / "other.toml")
    assert run(["check", str(tmp_path / "log"), "--controller-arm", str(tmp_path / "arm.toml")]) == 1
    assert "segment-0002.mcap are recordings of different rig files; give each by itself" in capsys.readouterr().err
    assert not (tmp_path / "arm.toml").exists()


def test_a_table_of_the_rtde_recorder_is_read_as_it_is(recorded, tmp_path, capsys):
    stream = read(recorded(controller(LENGTHENED_M), TOOL)[0]).streams["robot"]
    names = {"actual_q": "actual_q_rad", "target_q": "actual_q_rad", "actual_TCP_pose": "actual_tcp_pose_m_rad"}
    headings = ["timestamp", *(f"{name}_{k}" for name in names for k in range(6)), "actual_current_0"]
    columns = (
        stream.device_s[:, None],
        *(stream.values[c] for c in names.values()),
        stream.values["actual_q_rad"][:, :1],
    )
    np.savetxt(tmp_path / "rtde.csv", np.hstack(columns), header=" ".join(headings), comments="", fmt="%.15g")
    out = tmp_path / "rtde.mcap"
    assert run(["import", str(tmp_path / "rtde.csv"), "--streams", "--rig", str(RIG), "--out", str(out), "--yes"]) == 0
    (log,) = read(out).streams.values()
    np.testing.assert_allclose(log.host_s, stream.device_s, atol=1e-9)
    np.testing.assert_allclose(log.values["target_q_rad"], stream.values["actual_q_rad"], atol=1e-12)
    assert "actual_current_0" in log.values
    capsys.readouterr()
    (found,) = findings(out, capsys)
    assert "another arm than the rig file: link2.length 500.0" in found["says"]
