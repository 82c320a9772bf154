"""`import --restore-stamps` of a log, a session folder and a recording; what it refuses leaves nothing behind."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from calibeam.cli import run
from tests.acquisition.recording.stamped import world

RIG = Path(__file__).parents[2] / "docs" / "examples" / "lab" / "rig.toml"


def log_of(folder: Path, at_s: np.ndarray) -> Path:
    q = 10.0 * np.sin(np.arange(at_s.size) / 500.0)
    heading = "time [s]," + ",".join(f"A{i} [deg]" for i in range(1, 7))
    lines = [",".join(f"{v:.7f}" for v in (t, *[x] * 6)) for t, x in zip(at_s, q, strict=True)]
    path = folder / "robot.csv"
    path.write_text("\n".join([heading, *lines]))
    return path


def imported(source: Path, out: Path, *more: str) -> int:
    return run(["import", str(source), "--out", str(out), *more])


AS_LOG = ("--streams", "--rig", str(RIG), "--stamps", "arrived", "--yes")


def test_a_log_in_bursts_is_named_and_restored_from_the_log_its_recording_and_its_folder(tmp_path, capsys) -> None:
    one = world(7)
    log = log_of(tmp_path, one.in_bursts())
    assert imported(log, tmp_path / "plain.mcap", *AS_LOG) == 0
    run(["check", str(tmp_path / "plain.mcap")])  # a log has no settled samples
    assert "warning: bursts: stream robot: samples arrive in bursts" in capsys.readouterr().out
    assert run(["export", str(tmp_path / "plain.mcap"), "--out", str(tmp_path / "folder"), "--streams"]) == 0
    before = (tmp_path / "plain.mcap").read_bytes()
    assert imported(log, tmp_path / "of-log.mcap", *AS_LOG, "--restore-stamps") == 0
    assert imported(tmp_path / "plain.mcap", tmp_path / "of-recording.mcap", "--restore-stamps") == 0
    assert imported(tmp_path / "folder", tmp_path / "of-folder.mcap", "--restore-stamps") == 0
    assert capsys.readouterr().out.count("robot: time stamps restored: period ") == 3
    assert (tmp_path / "plain.mcap").read_bytes() == before
    for kind in ("log", "recording", "folder"):
        made = read(tmp_path / f"of-{kind}.mcap")
        robot = made.streams["robot"]
        assert robot.stamps == "restored"
        assert made.notes["restored_stamps_robot"].startswith("period ")
        error_s = robot.device_s - one.true_s
        assert np.ptp(error_s) < 1e-3
        assert np.array_equal(robot.host_s, read(tmp_path / "plain.mcap").streams["robot"].host_s)
        run(["check", str(tmp_path / f"of-{kind}.mcap")])
        shown = capsys.readouterr().out
        assert "time stamp: restored" in shown
        assert "warning" not in shown


@pytest.mark.parametrize("kind", ["log", "recording"])
def test_what_is_refused_names_the_file_and_writes_nothing(tmp_path, capsys, kind) -> None:
    log = log_of(tmp_path, np.delete(world(8).in_bursts(), np.s_[2000:2200]))
    source, more = log, AS_LOG
    if kind == "recording":
        assert imported(log, tmp_path / "plain.mcap", *AS_LOG) == 0
        source, more = tmp_path / "plain.mcap", ()
    assert imported(source, tmp_path / "made.mcap", *more, "--restore-stamps") == 1
    shown = " ".join(capsys.readouterr().err.split())
    assert f"{source}: stream robot: its time stamps cannot be restored: before sample 2001" in shown
    assert not (tmp_path / "made.mcap").exists()


def test_a_table_of_poses_has_no_times_to_restore(tmp_path, capsys) -> None:
    log = log_of(tmp_path, np.arange(20.0))
    assert imported(log, tmp_path / "made", "--rig", str(RIG), "--yes", "--restore-stamps") == 1
    assert "--restore-stamps concerns the times of a log; give --streams for a log" in capsys.readouterr().err
