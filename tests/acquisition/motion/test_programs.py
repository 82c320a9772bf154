"""Programs as data: both example tasks taught, unrolled and run; what does not fit together is told."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.errors import TaskError
from acquisition.motion.cell import Cell
from acquisition.motion.following import SetPointStream
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import apart, transform
from acquisition.motion.paths.path import BeltState
from acquisition.motion.paths.segments import Pace
from acquisition.motion.run_task import Around, run_task, teach
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Grasp, Move, Read, Release, unrolled
from acquisition.motion.task.task_file import Task, read_task
from tests.acquisition.motion.conftest import ur5e
from tests.acquisition.motion.test_gate import Arm, JumpingClock

TASKS = Path(__file__).parents[3] / "rigs" / "tasks"
SOLVER = Solver(ur5e(1e-3), closed_form(ur5e()))
HOME_RAD = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
PACE = Pace(np.full(6, 1.5), np.full(6, 8.0))
# Where things truly are in the cell, which the task is only taught.
TRUTH = {
    "P": transform((-0.45, -0.25, 0.15), (3.1, 0.1, 0.05)),
    "PA": transform((0.0, 0.0, -0.1)),
    "PD": transform((0.0, 0.0, -0.12)),
    "H": transform((-0.5, 0.1, 0.12), (3.0, 0.5, 0.0)),
    "PHA": transform((0.0, 0.0, -0.08)),
    "PCH": transform((0.002, 0.0, -0.03), (0.05, 0.0, 0.0)),
    "PAL": transform((0.0, 0.0, -0.025)),
    "HR2": transform((-0.03, 0.0, 0.0)),
}


def true_graph(task: Task) -> TaskGraph:
    graph = task.graph
    for name, T in TRUTH.items():
        graph = graph.with_value(name, T)
    return graph


def taught(task: Task) -> Task:
    """The task after its teaching, the arm being placed where things truly are."""
    truth = true_graph(task)
    placed = lambda at: SOLVER.nearest(truth.solve(at, "T6"), HOME_RAD)  # noqa: E731
    return Task(teach(task.graph, task.teach, SOLVER, placed), task.program)


def gate_of(arm: Arm) -> Gate:
    return Gate(SOLVER, PACE, Cell(), arm, SetPointStream(hz=50.0, solve_hz=50.0), JumpingClock())


def test_teaching_finds_every_transform_of_the_insertion() -> None:
    task = read_task(TASKS / "two-pins.toml")
    with pytest.raises(TaskError, match=r"before hole 1.*T6 is not determined.*H is missing \(not taught yet\).*PHA"):
        task.graph.solve("before hole 1", "T6")
    graph = taught(task).graph
    for name, T in TRUTH.items():
        off_m, off_rad = apart(graph.value(name), T)
        assert off_m < 1e-9, name
        assert off_rad < 1e-9, name


def test_teaching_out_of_order_says_what_is_missing() -> None:
    task = read_task(TASKS / "two-pins.toml")
    with pytest.raises(TaskError, match=r"before pin.*PA is not determined, because P is missing"):
        teach(task.graph, task.teach[1:], SOLVER, lambda at: HOME_RAD)


@pytest.fixture(scope="module")
def inserted() -> tuple[np.ndarray, list[tuple[str, np.ndarray]], TaskGraph]:
    """The whole insertion: every set-point, where the arm was at each action, and the true task."""
    task, arm = taught(read_task(TASKS / "two-pins.toml")), Arm()
    at: list[tuple[str, np.ndarray]] = []
    around = Around(joints=lambda: HOME_RAD, act=lambda action: at.append((action, arm.q_rad[-1])))
    run_task(gate_of(arm), task, around)
    return np.array(arm.q_rad), at, true_graph(task)


def test_two_pins_are_gripped_and_released_where_they_belong(inserted) -> None:
    _, at, truth = inserted
    assert [action for action, _ in at] == ["GRASP", "RELEASE", "GRASP", "RELEASE"]
    for (_, q_rad), position in zip(at, ("at pin", "in hole 1", "at pin", "in hole 2"), strict=True):
        assert apart(SOLVER.flange(q_rad), truth.solve(position, "T6"))[0] < 1e-6


def test_a_stop_leads_through_the_very_place(inserted) -> None:
    q_rad, _, truth = inserted
    flange_m = SOLVER.arm.frames(q_rad)[:, -1, :3, 3]
    nearest_m = {
        name: np.linalg.norm(flange_m - truth.solve(name, "T6")[:3, 3], axis=1).min()
        for name in ("upright in hole 1", "touching hole 2", "before pin")
    }
    assert nearest_m["upright in hole 1"] < 1e-4
    assert nearest_m["touching hole 2"] < 1e-4
    assert nearest_m["before pin"] > 1e-3


def test_a_part_on_a_running_belt_is_gripped_where_it_is_by_then() -> None:
    task = read_task(TASKS / "conveyor.toml")
    arm, rate_m_s = Arm(), 0.05

    def way_m(sent: int) -> float:
        return rate_m_s * sent / 50.0

    OBJ = transform((0.1, 0.02, 0.03), (0.0, 3.141592653589793, 0.0))
    seen: list[float] = []

    def belt() -> BeltState:
        return BeltState(way_m(len(arm.q_rad)), rate_m_s)

    def act(action: str) -> None:
        if action == "GRASP":
            sent = list(arm.q_rad)  # the stream goes on meanwhile
            now = SOLVER.flange(sent[-1])
            part = task.graph.with_value("OBJ", OBJ).solve("at part", "T6", s_m=way_m(len(sent)))
            seen.append(apart(now, part)[0])

    ran = run_task(gate_of(arm), task, Around(lambda: HOME_RAD, lambda name: OBJ, act, belt))
    assert len(ran.sweeps) == 1
    assert seen[0] < 1.5e-3  # the arm is read a cycle of 20 ms before the belt: 1 mm at this speed


def test_loops_are_unrolled_in_order() -> None:
    steps = list(unrolled(read_task(TASKS / "two-pins.toml").program))
    assert len(steps) == 20
    assert steps[4] == Move("before hole 1")
    assert steps[15] == Move("touching hole 2", by="line", stop=True)
    assert isinstance(steps[2], Grasp)
    assert isinstance(steps[18], Release)
    assert next(unrolled(read_task(TASKS / "conveyor.toml").program)) == Read("OBJ")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('[transform]\n[position]\np = "T6 = Q"', "Q is not among the transforms"),
        ('[transform]\nQ = {}\n[position]\np = "T6 = Q"\n[[step]]\ndo = "dance"', "dance"),
        ("[transform]\nQ = { untaught = true, unread = true }\n[position]", "only be one"),
        ("[transform]\nQ = { belt_direction = [0.0, 0.0, 0.0] }\n[position]", "points nowhere"),
        ("[transform", "Expected"),
    ],
)
def test_a_file_that_does_not_fit_together_is_refused_with_its_name(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "task.toml"
    path.write_text(text)
    with pytest.raises(TaskError, match=rf"task\.toml.*: .*{why}"):
        read_task(path)
