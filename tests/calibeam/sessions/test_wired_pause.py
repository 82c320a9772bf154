"""One session over real wires, paused by Ctrl-C and gone on with, then taken up again the day after."""

import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import read
from acquisition.recording.mcap import parts
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan, write_pose_plan
from acquisition.recording.rig import load_rig
from acquisition.session.control import RunState
from acquisition.session.plan import PlanOptions, blocks
from acquisition.session.records import Sample
from benchmarks.stops import emulated_rig, without_encoders
from calibeam.cli import run
from calibeam.emulation import Emulation
from calibeam.sessions.forecast import ahead_of_blocks
from calibeam.sessions.reporter import StatusReporter
from drivers.ur.reader import UrReader

from .conftest import RIG_FILE

POSES = 3
PATIENCE_S = 30.0


@pytest.fixture
def plan(rig, tmp_path) -> Path:
    """The first poses of a session's own plan, as joint poses: searched where dark, for the arm is not as drawn."""
    found = ahead_of_blocks(rig, tuple(blocks((1,), 0.01, PlanOptions(repeats=0)))[:1])
    q_rad = found.poses.q_rad[:POSES]
    block = PlannedBlock(pose=tuple(PlannedPose(tuple(q.tolist())) for q in q_rad), placement=1, first_psd=1)
    write_pose_plan(tmp_path / "plan.toml", PosePlan(schema=1, rig=rig.name, block=(block,)))
    return tmp_path / "plan.toml"


@pytest.fixture
def arguments(tmp_path, plan) -> Iterator[list[str]]:
    alone = tmp_path / "alone.toml"
    alone.write_text(without_encoders(RIG_FILE.read_text()))
    with Emulation(alone, seed=5, time_scale=4.0) as emulation:
        rig_file, where = emulated_rig(alone, emulation, tmp_path), emulation.address["control"]
        yield ["session", str(rig_file), "--out", str(tmp_path / "out"), "--plan", str(plan),
               "--control", f"{where['host']}:{where['port']}", "--time-scale", "4"]  # fmt: skip


@pytest.fixture
def interrupted(monkeypatch) -> None:
    """Ctrl-C at the first sample, which is heard before the next; and on again once it is paused."""
    take, turn, pausing = StatusReporter.sample, StatusReporter.state, threading.Event()

    def sample(teller: StatusReporter, sample: Sample) -> None:
        take(teller, sample)
        if not pausing.is_set():
            os.kill(os.getpid(), signal.SIGINT)
            assert pausing.wait(PATIENCE_S)

    def state(teller: StatusReporter, state: RunState) -> None:
        turn(teller, state)
        if state is RunState.PAUSING:
            pausing.set()
        elif state is RunState.PAUSED:
            os.kill(os.getpid(), signal.SIGCONT)

    monkeypatch.setattr(StatusReporter, "sample", sample)
    monkeypatch.setattr(StatusReporter, "state", state)


def test_a_word_typed_ahead_leaves_the_arm_where_it_stands(arguments, tmp_path, typist, capsys) -> None:
    before_rad = reported_rad(tmp_path / "rig.toml")
    typist.ahead("go\n")
    typist.answers("Type go to move, no to leave it: ", "no\n")
    assert run(arguments) == 1
    assert "nothing was moved: the answer was 'no'" in capsys.readouterr().err
    np.testing.assert_allclose(reported_rad(tmp_path / "rig.toml"), before_rad, atol=1e-5)
    assert parts(tmp_path / "out") == []
    assert "MEASUREMENT" not in (tmp_path / "out" / "session.log").read_text()


def reported_rad(rig_file: Path) -> np.ndarray:
    reader = UrReader(load_rig(rig_file).devices.robot.host)
    reader.connect()
    try:
        return reader.read(PATIENCE_S).values["actual_q_rad"][-1]
    finally:
        reader.close()


@pytest.mark.usefixtures("interrupted")
def test_paused_resumed_and_gone_on_with(arguments, tmp_path, capsys, monkeypatch) -> None:
    concluded: list[Path] = []
    monkeypatch.setattr(
        "calibeam.results.session_results.write_session_results", lambda path, console: concluded.append(path)
    )
    log = tmp_path / "out" / "session.log"
    code = run(arguments)
    said = log.read_text()
    assert code == 0, capsys.readouterr().err
    order = ["6  DEVICE CHECK", "6  PLAN PREVIEW", "6  CONFIRMATION", "6  MEASUREMENT", "paused, the arm stands"]
    assert sorted(map(said.index, order)) == [said.index(words) for words in order]
    assert said.count(" measuring") == 2
    assert f"pose {POSES} of {POSES}" in said
    assert read(tmp_path / "out" / "recording.mcap").complete
    assert (tmp_path / "out" / "recording.plan.svg").read_text().startswith("<?xml")

    assert run(arguments) == 1
    assert "--continue" in capsys.readouterr().err
    assert run([*arguments, "--continue"]) == 0
    assert "everything that was planned is taken" in log.read_text()
    assert concluded == [tmp_path / "out" / "recording.mcap"] * 2
    assert parts(tmp_path / "out") == concluded[:1]
