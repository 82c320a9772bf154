"""The examples of the source on a controller: joint and straight motion, a blend, a belt, two pins with their teaching.

Each plans, streams, and keeps what the controller reported beside what was planned. The cell of the examples is this
file's; a rig on site has its own tasks.

The lag of an arm behind its set-points, both by the host's clock: reported(t) = sent(t) - lag d(sent)/dt, the first
term of Taylor's series, good while the lag is short against the blends.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.following import Followed
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.kinematics import apart, transform
from acquisition.motion.paths.path import BeltState
from acquisition.motion.paths.segments import By, Place, Segment
from acquisition.motion.plan import Plan
from acquisition.motion.run_task import Around, run_task, teach
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.task_file import Task, read_task
from calibeam.motion.robot import StreamedArm, StreamedRobot
from calibeam.rig_files import RIGS
from drivers.clock import Clock

Floats = NDArray[np.float64]

LEAST_SPEED_RAD_S = 0.02  # of a joint, where it is judged: slower ones do not count


@dataclass
class KeptSetPoints:
    """Implements acquisition.motion.following.SetPoints on a controller, and remembers what that was sent."""

    arm: StreamedArm
    clock: Clock
    _sent: list[tuple[float, Floats]] = field(default_factory=list[tuple[float, Floats]])

    def servo_joints(self, q_rad: Floats, period_s: float, lookahead_s: float, gain: float) -> None:
        self._sent.append((self.clock.now_s(), q_rad.copy()))
        self.arm.servo_joints(q_rad, period_s, lookahead_s, gain)

    def servo_stop(self, deceleration_rad_s2: float) -> None:
        self.arm.servo_stop(deceleration_rad_s2)

    def stop(self) -> None:
        self.arm.stop()

    def clear(self) -> None:
        self._sent.clear()

    def sent(self) -> tuple[Floats, Floats]:
        """Host time (set-point,) and joints (set-point, joint)."""
        return np.array([t_s for t_s, _ in self._sent]), np.array([q_rad for _, q_rad in self._sent])


def lag_s(sent_s: Floats, sent_rad: Floats, heard_s: Floats, heard_rad: Floats) -> float:
    """By least squares over all joints that move; NaN where none does. Times (n,), joints (n, joint)."""
    later = np.diff(sent_s, prepend=-np.inf) > 0.0  # after a pause set-points may bear one time
    sent_s, sent_rad = sent_s[later], sent_rad[later]
    inside = (heard_s > sent_s[0]) & (heard_s < sent_s[-1])
    at_s = heard_s[inside]
    slope = np.gradient(sent_rad, sent_s, axis=0)
    sent = np.stack([np.interp(at_s, sent_s, column) for column in sent_rad.T], axis=1)
    speed = np.stack([np.interp(at_s, sent_s, column) for column in slope.T], axis=1)
    moves = np.abs(speed) > LEAST_SPEED_RAD_S
    if not moves.any():
        return float("nan")
    behind = (sent - heard_rad[inside])[moves]
    return float(behind @ speed[moves] / (speed[moves] @ speed[moves]))


TASKS = RIGS / "tasks"
START_RAD = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])  # the hand points down in front of the arm
TOOL = transform((0.0, 0.0, 0.15))
BELT_M_S = 0.05
PART_ON_BELT = transform((0.10, 0.02, 0.03), (0.0, np.pi, 0.0))
# Where things truly stand in the example's cell; the task is only taught.
PINS: Mapping[str, Floats] = {
    "P": transform((-0.45, -0.25, 0.15), (3.1, 0.1, 0.05)),
    "PA": transform((0.0, 0.0, -0.10)),
    "PD": transform((0.0, 0.0, -0.12)),
    "H": transform((-0.50, 0.10, 0.12), (3.0, 0.5, 0.0)),
    "PHA": transform((0.0, 0.0, -0.08)),
    "PCH": transform((0.002, 0.0, -0.03), (0.05, 0.0, 0.0)),
    "PAL": transform((0.0, 0.0, -0.025)),
    "HR2": transform((-0.03, 0.0, 0.0)),
}


@dataclass(frozen=True, eq=False)
class ExampleResult:
    """One sweep of an example: planned, and as the controller reported (time s, readings)."""

    name: str
    plan: Plan
    followed: Followed
    t_s: Floats
    q_rad: Floats
    corners: tuple[Floats, ...]  # (4, 4) of the tool at every target that stands
    lag_s: float  # by which the arm followed its set-points
    belt: Callable[[float], BeltState] | None = None  # by controller time since the sweep began
    figures: Mapping[str, float] | None = None


@dataclass(frozen=True)
class Stage:
    """The robot with its gate."""

    robot: StreamedRobot
    sent: KeptSetPoints
    gate: Gate
    solver: Solver
    draw: Callable[[str, Plan], None] = lambda name, made: None  # before the arm moves, the plan of an example

    def go(self, segments: list[Segment], draw_as: str = "") -> tuple[Plan, Followed]:
        made = self.gate.plan(self.robot.joints(), segments)
        if draw_as:
            self.draw(draw_as, made)
        self.clear()
        return made, self.gate.run(made, self.robot.joints(), watch=self.robot.supervisor.check)

    def clear(self) -> None:
        """Forget what was sent and heard so far."""
        self.robot.track.clear()
        self.sent.clear()

    def to_start(self) -> None:
        """By joints to where the examples begin."""
        place = Place("start", self.solver.flange(START_RAD), np.eye(4))
        segment = Segment("to the start", By.JOINTS, place)
        self.go([segment])

    def shown(self, name: str, made: Plan, followed: Followed) -> ExampleResult:
        t_s, q_rad = self.robot.track.joints()
        corners = tuple(s.place.flange_at(0.0) @ s.place.tool for s in made.segments if s.place.coord is None)
        behind_s = lag_s(*self.sent.sent(), self.robot.track.host_s()[: len(q_rad)], q_rad)
        return ExampleResult(name, made, followed, t_s - t_s[0], q_rad, corners, behind_s)


def joint_motion(stage: Stage) -> ExampleResult:
    """Through two corners by joints, and back."""
    stage.to_start()
    targets = [(0.10, 0.15, -0.05), (-0.05, 0.20, 0.10), (0.0, 0.0, 0.0)]
    return stage.shown("joint", *stage.go(_rectangle(stage, targets, By.JOINTS), "joint"))


def straight_motion(stage: Stage) -> ExampleResult:
    """Round a rectangle on straight lines, the hand turning on one side; its corners are the blend's close-up."""
    stage.to_start()
    targets = [(0.12, 0.0, 0.0), (0.12, 0.16, 0.0), (0.0, 0.16, 0.0), (0.0, 0.0, 0.0)]
    return stage.shown("straight", *stage.go(_rectangle(stage, targets, By.LINE), "straight"))


def belt(stage: Stage) -> ExampleResult:
    """A part on a belt that runs: read, followed, gripped, brought away."""
    stage.to_start()
    task = read_task(TASKS / "conveyor.toml")
    begin_s = [0.0]

    def now() -> BeltState:
        return BeltState(BELT_M_S * (stage.robot.clock.now_s() - begin_s[0]), BELT_M_S)

    def read(name: str) -> Floats:
        begin_s[0] = stage.robot.clock.now_s()  # the part comes into the picture as it is read
        stage.clear()
        return PART_ON_BELT

    gripped: list[float] = []

    def act(action: str) -> None:
        q_rad, s_m = _newest(stage), now().s_m
        part = task.graph.with_value("OBJ", PART_ON_BELT)
        if action == "GRASP":
            gripped.append(apart(stage.solver.flange(q_rad), part.solve("at part", "T6", s_m=s_m))[0])

    watch, planned = stage.robot.supervisor.check, partial(stage.draw, "belt")
    ran = run_task(stage.gate, task, Around(stage.robot.joints, read, act, now, watch, planned))
    made, followed = ran.sweeps[0]
    shown = stage.shown("belt", made, followed)
    figures = {"hand from part when gripped, m": gripped[0]}
    return replace(shown, belt=_belt, figures=figures)


def two_pins(stage: Stage) -> ExampleResult:
    """Teach by placing the arm, then the whole program; each transform that was taught is compared with the truth."""
    stage.to_start()
    task = read_task(TASKS / "two-pins.toml")
    truth = task.graph
    for name, T in PINS.items():
        truth = truth.with_value(name, T)

    def placed(at: str) -> Floats:
        stage.go([Segment(at, By.JOINTS, truth.place(at))])
        return stage.robot.joints()

    graph = teach(task.graph, task.teach, stage.solver, placed)
    stage.to_start()
    stage.clear()
    at_action: list[tuple[str, Floats]] = []
    around = Around(
        stage.robot.joints,
        act=lambda action: at_action.append((action, _newest(stage))),
        watch=stage.robot.supervisor.check,
        planned=partial(stage.draw, "two-pins"),
    )
    ran = run_task(stage.gate, Task(graph, task.program), around)
    made, followed = ran.sweeps[0]
    shown = stage.shown("two-pins", made, followed)
    figures = _pin_figures(stage, graph, truth, at_action)
    return replace(shown, figures=figures)


def _pin_figures(
    stage: Stage, graph: TaskGraph, truth: TaskGraph, at_action: list[tuple[str, Floats]]
) -> Mapping[str, float]:
    taught = max(apart(graph.value(name), T)[0] for name, T in PINS.items())
    where = ("at pin", "in hole 1", "at pin", "in hole 2")
    off = [
        apart(stage.solver.flange(q), truth.solve(name, "T6"))[0] for (_, q), name in zip(at_action, where, strict=True)
    ]
    return {"taught transforms from the truth, m": taught, "hand from pin or hole at GRASP, RELEASE, m": max(off)}


def _rectangle(stage: Stage, targets: list[tuple[float, float, float]], by: By) -> list[Segment]:
    start = stage.solver.flange(START_RAD) @ TOOL
    turns = [0.0, 0.4, 0.4, 0.0]
    out: list[Segment] = []
    for number, (shift, turn) in enumerate(zip(targets, turns, strict=False), start=1):
        last = number == len(targets)
        pos = start @ transform(shift, (0.0, 0.0, 0.0 if last else turn))
        out.append(Segment(f"corner {number}", by, Place(f"corner {number}", pos, TOOL)))
    return out


def _newest(stage: Stage) -> Floats:
    block = stage.robot.pump.latest()
    if block is None:
        return stage.robot.joints()
    out: Floats = block.values["actual_q_rad"][-1]
    return out


def _belt(t_s: float) -> BeltState:
    return BeltState(BELT_M_S * t_s, BELT_M_S)


EXAMPLES: Mapping[str, Callable[[Stage], ExampleResult]] = {
    "joint": joint_motion,
    "straight": straight_motion,
    "belt": belt,
    "two-pins": two_pins,
}
