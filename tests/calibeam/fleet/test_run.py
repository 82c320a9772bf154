"""A run over a folder: what stands is not done again, and Ctrl-C loses nothing."""

import msgspec
import pytest

from calibeam.fleet import run as module
from calibeam.fleet.recordings import Workers
from calibeam.fleet.row import Outcome
from calibeam.fleet.run import RunOptions, run
from calibeam.fleet.table import read_rows

ONE = Workers(jobs=1)  # in this process: who reads is a process of its own all the same


@pytest.fixture
def ran(reader, tmp_path):
    """Runs over a folder with the reader that loads nothing."""
    out = tmp_path / "out"

    def go(root, tell=lambda done, total, name: None, **wanted):
        settings = {"workers": ONE, "command": reader, "timeout_s": 30.0} | wanted
        return run(root, out, RunOptions(**settings), tell)

    go.table = out / "fleet.parquet"
    return go


def test_the_bad_ones_become_rows_and_the_run_goes_on(ran, folder):
    done = ran(folder("a.mcap", "broken.mcap", "exits.mcap", "z.mcap"))
    assert {row.name: row.outcome for row in done.rows} == {
        "a.mcap": Outcome.IDENTIFIED,
        "broken.mcap": Outcome.FAILED,
        "exits.mcap": Outcome.LOST,
        "z.mcap": Outcome.IDENTIFIED,
    }
    assert read_rows(ran.table) == sorted(done.rows, key=lambda row: row.name)


def test_only_new_changed_and_lost_ones_are_done_again(ran, folder):
    root = folder("a.mcap", "b.mcap", "broken.mcap", "exits.mcap", "gone.mcap")
    ran(root)
    (root / "b.mcap").write_text("another content")
    (root / "gone.mcap").unlink()
    folder("new.mcap")
    names = []
    done = ran(root, lambda done, total, name: names.append(name))
    assert sorted(names) == ["", "b.mcap", "exits.mcap", "new.mcap"]
    assert (done.stood, done.kept) == (2, 1)


def test_a_file_that_was_only_moved_or_touched_stands(ran, folder):
    root = folder("robot-1/a.mcap", "robot-2/b.mcap")
    ran(root)
    (root / "robot-1" / "a.mcap").rename(root / "robot-2" / "moved.mcap")
    (root / "robot-2" / "b.mcap").touch()
    done = ran(root, by_folder=True)
    assert done.stood == 2
    assert {(row.name, row.robot) for row in done.rows} == {
        ("robot-2/moved.mcap", "robot-2"),
        ("robot-2/b.mcap", "robot-2"),
    }
    assert len(read_rows(ran.table)) == 2


def test_a_more_thorough_run_or_one_that_is_forced_does_all_again(ran, folder):
    root = folder("a.mcap")
    ran(root)
    assert ran(root, diagnose=True).stood == 0
    assert ran(root).stood == 1  # diagnosed is more than was asked for
    assert ran(root, again=True).stood == 0


def test_an_update_of_the_program_does_all_again(ran, folder, monkeypatch):
    root = folder("a.mcap")
    ran(root)
    monkeypatch.setattr("calibeam.fleet.run.SOFTWARE", "calibeam of tomorrow")
    assert ran(root).stood == 0


def test_ctrl_c_keeps_what_is_done_and_the_next_run_goes_on(ran, folder):
    root = folder("a.mcap", "b.mcap", "c.mcap")

    def interrupt(done, total, name):
        if done == 1:
            raise KeyboardInterrupt

    stopped = ran(root, interrupt)
    assert (stopped.stopped, stopped.left, len(stopped.rows)) == ("Ctrl-C", 2, 1)
    assert len(read_rows(ran.table)) == 1
    done = ran(root)
    assert (done.stood, done.left, len(done.rows)) == (1, 0, 3)


def test_all_anew_that_was_stopped_goes_on_and_loses_nothing(ran, folder):
    root = folder("a.mcap", "b.mcap", "c.mcap")
    ran(root)

    def interrupt(done, total, name):
        if done == 1:
            raise KeyboardInterrupt

    stopped = ran(root, interrupt, again=True)
    assert (stopped.stopped, stopped.left, len(stopped.rows)) == ("Ctrl-C", 2, 3)
    done = ran(root)
    assert (done.stood, len(done.rows)) == (1, 3)


def test_a_part_has_no_row_of_its_own_once_its_session_was_gone_on_with(ran, folder):
    root = folder("r7/recording.mcap")
    ran(root)
    folder("r7/recording-0002.mcap")
    done = ran(root)
    assert [row.path for row in read_rows(ran.table)] == [row.path for row in done.rows] == [str(root / "r7")]


def test_a_robot_is_named_by_its_serial_number_else_by_its_rig(folder, reader):
    row = module.Row("/f/a/b.mcap", "a/b.mcap", "", 0, 0, Outcome.IDENTIFIED, "", rig="ur5", robot_serial="77")
    named = module._named(row, {row.path: "a"}, RunOptions())
    assert named.robot == "77"
    assert module._named(msgspec.structs.replace(row, robot_serial=""), {}, RunOptions()).robot == "ur5"
    assert module._named(row, {row.path: "a"}, RunOptions(by_folder=True)).robot == "a"
