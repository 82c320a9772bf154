"""Before a program moves: what it lacks and what supplies it; a task file in which something was taught."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.errors import InterruptedMotionError, TaskError
from acquisition.motion.kinematics import apart, transform
from acquisition.motion.run_task import Around, run_task
from acquisition.motion.states import MotionState
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Move, Read
from acquisition.motion.task.ready import BELT, HAND, missing, taught_text
from acquisition.motion.task.task_file import Hand, ReadSource, Task, read_task
from acquisition.motion.task.transforms import Constant, Unread, parse_equation
from tests.acquisition.motion.test_gate import Arm
from tests.acquisition.motion.test_programs import HOME_RAD, SOLVER, TASKS, gate_of, taught

PINS, BELT_TASK = TASKS / "two-pins.toml", TASKS / "conveyor.toml"


def test_each_untaught_transform_is_named_once_with_where_to_teach_it() -> None:
    lines = missing(read_task(PINS), camera=False)
    assert len(lines) == 8
    assert lines[0] == "P is not taught: `calibeam task teach`, with the arm placed at 'at pin'"
    assert missing(taught(read_task(PINS)), camera=False) == (HAND,)  # `taught` leaves the hand out
    assert missing(replace(taught(read_task(PINS)), hand=Hand("standard 0")), camera=False) == ()


def test_a_belt_program_lacks_reading_belt_and_hand() -> None:
    lines = missing(read_task(BELT_TASK), camera=False)
    assert lines == ("READ OBJ: add [read.OBJ] with a file, or with camera = true", BELT, HAND)


def seen_task(program: tuple = (Read("B"), Move("at"))) -> Task:
    """The part PC is where the board is seen; the board is B from the flange."""
    transforms = {"P": Unread(), "B": Unread(), "E": Constant(transform((0.0, 0.0, 0.1)))}
    positions = {"seen": parse_equation("T6 B = P"), "at": parse_equation("T6 E = P")}
    reading = {"B": ReadSource(camera=True, at="seen", gives="P")}
    return Task(TaskGraph(transforms, positions), program, read=reading)


def test_a_camera_is_wanted_only_where_it_is_read_and_before_the_move() -> None:
    assert missing(seen_task(), camera=True) == ()
    assert missing(seen_task(), camera=False) == (
        "READ B: the rig has no [camera] with a calibration; `calibeam camera` measures it",
    )
    assert missing(seen_task((Move("at"), Read("B"))), camera=True) == (
        "P is used before it is read: READ it before the MOVE",
    )


def test_what_a_reading_gives_is_where_the_arm_stood_when_it_read() -> None:
    arm, T_flange_board = Arm(), transform((0.02, -0.05, 0.30), (0.2, -0.1, 0.3))
    around = Around(lambda: (arm.q_rad or [HOME_RAD])[-1], read=lambda name: T_flange_board)
    gate = gate_of(arm)
    ran = run_task(gate, seen_task(), around)
    off_m, off_rad = apart(ran.graph.value("P"), SOLVER.flange(HOME_RAD) @ T_flange_board)
    assert (off_m, off_rad) == pytest.approx((0.0, 0.0), abs=1e-9)
    off_m, _ = apart(SOLVER.flange(arm.q_rad[-1]) @ transform((0.0, 0.0, 0.1)), ran.graph.value("P"))
    assert off_m < 1e-6


def test_a_motion_stopped_by_hand_ends_the_program_with_it() -> None:
    task = taught(read_task(PINS))
    arm = Arm()
    gate = gate_of(arm)

    def watch() -> None:
        if len(arm.q_rad) > 40 and gate.state is MotionState.MOVING:
            gate.stop()

    around = Around(lambda: (arm.q_rad or [HOME_RAD])[-1], watch=watch)
    with pytest.raises(InterruptedMotionError, match="stopped before its end"):
        run_task(gate, task, around)


@pytest.mark.parametrize("name", ["P", "HR2"])
def test_a_taught_transform_changes_its_line_only(name: str, tmp_path: Path) -> None:
    T = transform((0.1, -0.2, 0.3), (0.4, 0.5, -0.6))
    text = PINS.read_text(encoding="utf-8")
    new = taught_text(text, name, T)
    changed = [i for i, (a, b) in enumerate(zip(text.splitlines(), new.splitlines(), strict=True)) if a != b]
    assert len(changed) == 1
    (tmp_path / "task.toml").write_text(new, encoding="utf-8")
    np.testing.assert_allclose(read_task(tmp_path / "task.toml").graph.value(name), T, atol=1e-9)


def test_a_transform_in_a_table_of_its_own_is_taught_as_well(tmp_path: Path) -> None:
    T, file = transform((0.1, -0.2, 0.3), (0.4, 0.5, -0.6)), tmp_path / "task.toml"
    file.write_text('[transform.A]\n\n[transform.P]  # pin\nuntaught = true\n\n[position]\n"at" = "T6 A = P"\n')
    file.write_text(taught_text(file.read_text(), "P", T))
    np.testing.assert_allclose(read_task(file).graph.value("P"), T, atol=1e-9)
    with pytest.raises(TaskError, match="transform A: 'untaught = true' was not found"):
        taught_text(file.read_text(), "A", T)


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        ("[read.B]\n", "either a file or camera"),
        ('[read.B]\nfile = "b.toml"\ncamera = true\n', "either a file or camera"),
        ("[read.A]\ncamera = true\n", "A is not a transform with unread = true"),
        ('[read.B]\ncamera = true\nat = "at"\n', "belong together"),
        ('[read.B]\ncamera = true\nat = "there"\ngives = "B"\n', "there is not among the positions"),
        (
            '[belt]\nm_per_turn = 0.0\n[belt.encoder]\ndriver = "cia406"\ninterface = "slcan"\n',
            "in one turn of the encoder",
        ),
    ],
)
def test_devices_that_cannot_be_are_refused_with_the_table(lines: str, why: str, tmp_path: Path) -> None:
    file = tmp_path / "task.toml"
    file.write_text(f'[transform]\nA = {{}}\nB = {{ unread = true }}\n[position]\nat = "T6 A = B"\n{lines}')
    with pytest.raises(TaskError, match=why) as refused:
        read_task(file)
    assert str(refused.value).startswith(str(file))
