"""Teaches a task and runs its program through the gate: a sweep of the arm, a reading of the camera, the next sweep.

A sweep is what the arm does in one go: the segments of a path up to the next reading of a camera.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import InterruptedMotionError, TaskError
from acquisition.motion.following import Followed
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.path import STANDING, BeltState
from acquisition.motion.paths.segments import By, Place, Segment
from acquisition.motion.plan import Plan
from acquisition.motion.setpoints import BeltNow
from acquisition.motion.task.graph import TaskGraph
from acquisition.motion.task.program import Grasp, Move, Plain, Read, Release, Step, unrolled
from acquisition.motion.task.task_file import Task, Teach

GRASP, RELEASE = "GRASP", "RELEASE"


def next_sweep(graph: TaskGraph, steps: Sequence[Plain]) -> tuple[tuple[Segment, ...], int]:
    """The segments before the next READ, and how many steps they are. TaskError where a position is not determined."""
    segments: list[Segment] = []
    place: Place | None = None
    for count, step in enumerate(steps):
        match step:
            case Read():
                return tuple(segments), count
            case Move(to, by, time_s, stop):
                place = graph.place(to)
                segments.append(Segment(to, By.LINE if by == "line" else By.JOINTS, place, time_s))
                if stop:
                    segments.append(Segment(f"stop at {to}", By.STAND, place))
            case Grasp(wait_s) | Release(wait_s):
                if place is None:
                    raise TaskError("GRASP or RELEASE before the first MOVE of a sweep: move somewhere first")
                action = GRASP if isinstance(step, Grasp) else RELEASE
                segments.append(Segment(f"{action} at {place.name}", By.STAND, place, wait_s, action=action))
    return tuple(segments), len(steps)


Floats = NDArray[np.float64]


def undrawn(made: Plan) -> None:
    """For who draws no plans."""


def no_hand(action: str) -> None:
    """For an arm that carries nothing: GRASP and RELEASE only wait."""


def no_camera(name: str) -> Floats:
    """TaskError: there is none."""
    raise TaskError(f"READ {name}: no camera is connected; give the transform in the task instead")


@dataclass(frozen=True)
class Around:
    """What a program needs beside the arm. `belt` gives how far the belt has gone, now."""

    joints: Callable[[], Floats]  # readings (joint,) of the arm, which rests
    read: Callable[[str], Floats] = no_camera  # T (4, 4) of a transform that a camera sees
    act: Callable[[str], None] = no_hand  # GRASP, RELEASE
    belt: BeltNow = lambda: STANDING
    watch: Callable[[], None] = lambda: None
    planned: Callable[[Plan], None] = undrawn  # each sweep, before the arm moves: to draw it, or to ask


@dataclass
class Ran:
    """What a program did: the task with everything read, and each sweep as planned and as streamed."""

    graph: TaskGraph
    sweeps: list[tuple[Plan, Followed]] = field(default_factory=list[tuple[Plan, Followed]])


def teach(graph: TaskGraph, steps: Sequence[Teach], solver: Solver, placed: Callable[[str], Floats]) -> TaskGraph:
    """The task with its transforms taught; `placed` has the arm placed at a position and returns its readings (joint,).

    TaskError where a step cannot be solved yet.
    """
    for step in steps:
        if step.at not in graph.positions:
            raise TaskError(f"teach {step.transform}: {step.at} is not among the positions of the task")
        graph = graph.taught(step.transform, step.at, solver.flange(placed(step.at)))
    return graph


def run_task(gate: Gate, task: Task, around: Around) -> Ran:
    """The whole program. TaskError, RefusedMotionError before a sweep; InterruptedMotionError, DeviceError in one."""
    task.graph.check()
    ran = Ran(task.graph)
    steps: Sequence[Step] = task.program
    plain = list(unrolled(tuple(steps)))
    while plain:
        segments, count = next_sweep(ran.graph, plain)
        if segments:
            now_rad = around.joints()
            made = gate.plan(now_rad, segments, _expected(around.belt()))
            around.planned(made)
            followed = gate.run(made, around.joints(), around.belt, around.act, around.watch)
            ran.sweeps.append((made, followed))
            if followed.cut_short:
                raise InterruptedMotionError("the motion was stopped before its end, and the program with it")
        if count < len(plain):
            name = plain[count].transform  # type: ignore[union-attr] - a sweep ends before a READ only
            ran.graph = _read(gate, task, ran.graph, name, around)
            ran.graph.check()
        plain = plain[count + 1 :]
    return ran


def _read(gate: Gate, task: Task, graph: TaskGraph, name: str, around: Around) -> TaskGraph:
    """The task with what a READ brings, and with what follows from it where the arm stands."""
    graph = graph.with_value(name, around.read(name))
    reading = task.read.get(name)
    if reading is None or reading.at is None or reading.gives is None:
        return graph
    return graph.taught(reading.gives, reading.at, gate.solver.flange(around.joints()))


def _expected(belt: BeltState) -> Callable[[float], BeltState]:
    """The belt as it will be if it keeps its speed."""
    return lambda t_s: BeltState(belt.s_m + belt.rate_m_s * t_s, belt.rate_m_s)
