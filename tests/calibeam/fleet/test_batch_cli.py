"""`batch` on recordings of an emulated fleet: one table, one page, and what failed in words."""

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from mcap.reader import make_reader

from acquisition.recording.rig import load_rig
from benchmarks.fleet_sessions import Robot, write_fleet
from calibeam.cli import run
from calibeam.commands.batch import _end
from calibeam.fleet.recordings import find_recordings
from calibeam.fleet.row import Outcome, Task, Zero
from calibeam.fleet.run import RunResult
from calibeam.fleet.summary import Fleet
from calibeam.fleet.table import read_rows
from calibeam.fleet.worker import _zeros, judge_recording
from calibeam.outcome import PartialResult
from calibrate.model.model_file import ModelParameter

RIG = Path(__file__).parents[3] / "rigs" / "irb120-modbus.toml"
OFF_RAD_YEAR = 0.02  # of joint 2: far beyond any doubt of two dates


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    root = tmp_path_factory.mktemp("fleet")
    paths = write_fleet(root, [Robot("A-1", 41, {2: OFF_RAD_YEAR})], ("2025-11-03", "2026-11-03"))
    torn = root / "A-1" / "torn.mcap"
    torn.write_bytes(paths[0].read_bytes()[: within_the_first_batch(paths[0])])
    return root


def within_the_first_batch(path: Path) -> int:
    """How many rows lie before a given share of the file depends on how often the writer came to write."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return summary.chunk_indexes[0].chunk_start_offset + 100


@pytest.fixture(scope="module")
def out(fleet, tmp_path_factory):
    where = tmp_path_factory.mktemp("out")
    assert run(["batch", str(fleet), "--out", str(where), "--jobs", "1"]) == 3
    return where


def test_a_recording_becomes_its_row(out):
    rows = {row.name: row for row in read_rows(out / "fleet.parquet")}
    first, second = rows["A-1/2025-11-03.mcap"], rows["A-1/2026-11-03.mcap"]
    assert (first.outcome, first.robot, first.robot_serial, first.samples) == (Outcome.IDENTIFIED, "A-1", "A-1", 60)
    assert first.started_utc == "2025-11-03"
    assert first.instruments == ("position",)
    assert len(first.zeros) == 6
    assert first.zeros[0].value_rad is None
    assert "only in combination" in first.zeros[0].status
    gained = (second.zeros[1].value_rad or 0.0) - (first.zeros[1].value_rad or 0.0)
    assert gained == pytest.approx(OFF_RAD_YEAR * 365 / 365.25, abs=5.0 * (first.zeros[1].sigma_rad or 0.0))
    assert first.free_space_after_m is not None
    assert first.free_space_before_m is not None
    assert first.free_space_before_m > 10.0 * first.free_space_after_m
    assert 1e-5 < first.noise["position"] < 3e-5
    torn = rows["A-1/torn.mcap"]
    assert torn.outcome is Outcome.FAILED
    assert "no settled sample is left" in torn.error


def test_what_stands_is_reported_again_with_what_failed(fleet, out, capsys):
    assert run(["batch", str(fleet), "--out", str(out), "--jobs", "1", "--json"]) == 3
    said = json.loads(capsys.readouterr().out)
    assert (said["recordings"], said["identified"], said["stood"], said["robots"]) == (3, 2, 3, ["A-1"])
    assert said["failed"][0]["name"] == "A-1/torn.mcap"
    assert "A-1/torn.mcap" in (out / "fleet.html").read_text()


def test_what_is_no_recording_fails_in_words(tmp_path):
    (tmp_path / "text.mcap").write_text("nothing of the kind")
    (tmp_path / "away.mcap").symlink_to(tmp_path / "nowhere")
    found = find_recordings(tmp_path, tmp_path / "-")
    errors = {one.name: judge_recording(Task.of(one, diagnose=False)).error for one in found}
    assert "not a recording" in errors["text.mcap"]
    assert "No such file" in errors["away.mcap"]


def test_a_zero_comes_with_what_the_rig_file_draws():
    first = ModelParameter("joint1.zero", "rad", None, None, "why")
    second = ModelParameter("joint2.zero", "rad", 1e-3, 1e-5, None)
    lines = _zeros(SimpleNamespace(parameters=(first, second)), load_rig(RIG))
    assert lines == (Zero(1, None, None, "why", 0.0), Zero(2, 1e-3, 1e-5, "determined", -math.pi / 2.0))


def test_a_stopped_run_says_how_to_go_on():
    ran = RunResult((), 0, 0, 2, stopped="SIGTERM")
    for again, says in ((True, "leave --again out to go on"), (False, "the same command goes on")):
        with pytest.raises(PartialResult, match=says):
            _end(ran, Fleet(()), Path("out"), again=again)


def test_nothing_found_is_one_sentence(tmp_path, capsys):
    assert run(["batch", str(tmp_path), "--out", str(tmp_path / "out")]) == 1
    assert "no recording (*.mcap)" in capsys.readouterr().err
