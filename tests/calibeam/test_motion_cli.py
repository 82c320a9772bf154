"""`calibeam move`, `jog` and `motion` on an emulated controller: where the arm ends, and what is refused."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from benchmarks.stops import MOVES_RAD_S, Watch
from calibeam.cli import run
from calibeam.emulation import Emulation
from calibeam.motion.robot import streamed_robot
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
HOME_DEG = np.degrees([0.3, -1.4, 1.6, -0.5, 0.5, 0.0])
PATIENCE_S = 60.0
WALL = '[[motion.keep_out]]\nname = "wall"\nlower_m = [-2.0, -2.0, 0.75]\nupper_m = [2.0, 2.0, 0.9]\n'


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Generator[Path]:
    """A rig file whose controller is an emulated one that runs."""
    with Emulation(RIG) as emulation:
        path = tmp_path_factory.mktemp("rig") / "rig.toml"
        text = re.sub(r'host = "127.0.0.2"', f'host = "{emulation.address["robot"]["host"]}"', RIG.read_text())
        path.write_text(text.replace("\n[emulation]\n", f"\n{WALL}\n[emulation]\n"))
        yield path


def stands_deg(rig: Path) -> np.ndarray:
    with streamed_robot(load_rig(rig), SystemClock()) as robot:
        return np.degrees(robot.joints())


def test_moved_to_joints_and_jogged_it_stands_there(rig: Path, tmp_path: Path, capsys) -> None:
    plan = tmp_path / "plan.svg"
    target = HOME_DEG + np.array([4.0, -3.0, 2.0, 0.0, 5.0, 3.0])
    words = [f"{value:.6f}" for value in target]
    assert run(["move", str(rig), "--joints-deg", *words, "--yes", "--out", str(plan)]) == 0
    assert "fastest joint 5" in capsys.readouterr().out
    assert plan.read_text().startswith("<?xml")
    np.testing.assert_allclose(stands_deg(rig), target, atol=2e-3)  # settled, within a few encoder counts
    assert run(["jog", str(rig), "--joint", "6", "--by-deg", "-3", "--yes", "--out", str(plan)]) == 0
    np.testing.assert_allclose(stands_deg(rig), target - np.array([0, 0, 0, 0, 0, 3.0]), atol=2e-3)


def test_a_dry_run_draws_and_moves_nothing(rig: Path, tmp_path: Path, capsys) -> None:
    plan, before = tmp_path / "plan.svg", stands_deg(rig)
    assert run(["jog", str(rig), "--axis", "z", "--by-mm", "20", "--dry-run", "--out", str(plan)]) == 0
    assert "nothing was moved" in capsys.readouterr().out
    assert plan.exists()
    np.testing.assert_allclose(stands_deg(rig), before, atol=1e-4)


def test_what_was_typed_ahead_moves_nothing(rig: Path, tmp_path: Path, typist, capsys) -> None:
    before, command = stands_deg(rig), ["--axis", "z", "--by-mm", "20", "--out", str(tmp_path / "plan.svg")]
    typist.ahead("go\n")
    typist.answers("Type go to move, no to leave it: ", "yes\n", "q\n")
    assert run(["jog", str(rig), *command]) == 1
    assert "nothing was moved: the answer was 'q'" in capsys.readouterr().err
    np.testing.assert_allclose(stands_deg(rig), before, atol=1e-4)


def test_a_motion_into_a_keep_out_box_is_refused(rig: Path, tmp_path: Path, capsys) -> None:
    up = ["0", "-90", "0", "-90", "0", "0"]
    assert run(["move", str(rig), "--joints-deg", *up, "--yes", "--out", str(tmp_path / "plan.svg")]) == 1
    assert "keep-out box 'wall'" in capsys.readouterr().err


def until(happened: Callable[[], bool]) -> bool:
    end_s = time.monotonic() + PATIENCE_S
    while not happened() and time.monotonic() < end_s:
        time.sleep(0.01)
    return happened()


def test_a_move_whose_program_was_frozen_is_given_up(rig: Path, tmp_path: Path) -> None:
    target = [*(f"{value:.6f}" for value in HOME_DEG[:5]), "120"]
    command = [sys.executable, "-m", "calibeam", "move", str(rig), "--joints-deg", *target, "--yes"]
    device = load_rig(rig).devices.robot
    assert device is not None
    assert device.host is not None
    watch = Watch(device.host)
    with subprocess.Popen(
        [*command, "--out", str(tmp_path / "plan.svg")], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as program:
        try:
            assert until(lambda: watch.newest()[1] > 0.5)
            program.send_signal(signal.SIGSTOP)
            assert until(lambda: watch.newest()[1] < MOVES_RAD_S)
            stood_s = watch.newest()[0]
            program.send_signal(signal.SIGCONT)
            _, said = program.communicate(timeout=PATIENCE_S)
        finally:
            program.kill()
    ended_s = watch.newest()[0]
    assert until(lambda: watch.newest()[0] > ended_s + 1.0)
    watch.close()
    assert watch.since(stood_s)[1].max() < MOVES_RAD_S
    assert program.returncode == 1
    assert said.startswith("error: ")
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["move"], "give one of"),
        (["move", "--joints-deg", "1", "2"], "2 numbers, but the arm has 6 joints"),
        (["move", "--home", "--speed", "2"], "above 0 and up to 1"),
        (["jog", "--joint", "1"], "give --joint N --by-deg A"),
        (["jog", "--axis", "x", "--by-mm", "500"], "at most 100 mm"),
        (["jog", "--joint", "9", "--by-deg", "1"], "joints 1 to 6"),
    ],
)
def test_what_makes_no_sense_is_reported_before_any_line_is_opened(arguments: list[str], why: str, capsys) -> None:
    command, *options = arguments
    assert run([command, str(RIG), *options]) == 1
    assert why in capsys.readouterr().err


def test_the_examples_leave_plots_and_figures(tmp_path: Path) -> None:
    assert run(["motion", "--only", "joint", "--out", str(tmp_path)]) == 0
    lines = json.loads((tmp_path / "motion.json").read_text())["examples"]
    assert lines["joint"]["hand off its planned track at most, m"] < 3e-3  # the controller smooths over 30 ms
    assert (tmp_path / "joint.svg").stat().st_size > 10_000
    drawn_s, said_s = ((tmp_path / name).stat().st_mtime for name in ("plan-joint.svg", "joint.svg"))
    assert drawn_s < said_s  # the plan is drawn before the arm moves
