"""A task of one's own on the rig's arm: taught position by position, then run sweep by sweep.

Teaching only reads: how the arm comes to a position is the operator's choice, so that no teaching can move it.
"""

import csv
import math
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RefusedMotionError, TaskError
from acquisition.motion.following import Followed
from acquisition.motion.plan import Plan
from acquisition.motion.run_task import Around, next_sweep, run_task
from acquisition.motion.setpoints import Deviation, deviation, rates_text
from acquisition.motion.task.program import unrolled
from acquisition.motion.task.ready import missing, taught_text
from acquisition.motion.task.task_file import Task, read_task
from acquisition.motion.task.transforms import Untaught
from acquisition.recording.files import read_text
from acquisition.recording.output import toml_output, write_output
from acquisition.recording.rig import Rig
from calibeam.asking import YES, NotAgreedError, at_terminal, someone
from calibeam.console import Console
from calibeam.motion.by_hand import draw_plan_file, keys_of, said
from calibeam.motion.gate_of_rig import UR_STREAM_HZ, cell_of, gate_of, solver_of
from calibeam.motion.robot import streamed_robot, watched_joints
from calibeam.motion.task_devices import open_task_devices
from drivers.clock import SystemClock

Floats = NDArray[np.float64]
MOVED_RAD = 1e-3  # as the gate allows between a plan and its motion
Placed = Callable[[str], Floats]  # from a position's name to the readings (joint,) of the arm placed there

TASK = toml_output(("teach",), "task file")


def teach_by_hand(rig: Rig, file: Path, out: Path, poses: Path | None, model: Path | None, console: Console) -> None:
    """Every untaught transform of the file's [[teach]], in its order, into `out`. TaskError, NotAgreedError.

    What was taught until an end by the operator is in `out` as well, and can be taught on from there.
    """
    if out.exists() and out != file:
        raise TaskError(f"{out} is there already and is not written over; choose another --out")
    text, task, solver = read_text(file, "task", TaskError), read_task(file), solver_of(rig, model)
    todo = [step for step in task.teach if isinstance(task.graph.transforms.get(step.transform), Untaught)]
    if not todo:
        console.print(f"{file}: nothing is left to teach", soft_wrap=True)
        return
    with _placing(rig, poses) as placed:
        graph = task.graph
        for number, step in enumerate(todo, start=1):
            if step.at not in graph.positions:
                raise TaskError(f"teach {step.transform}: {step.at} is not among the positions of the task")
            q_rad = placed(step.at)
            graph = graph.taught(step.transform, step.at, solver.flange(q_rad))
            text = taught_text(text, step.transform, graph.value(step.transform))
            write_output(out, text, TASK)
            mm = np.round(1e3 * graph.value(step.transform)[:3, 3], 2).tolist()
            console.print(f"{number} of {len(todo)}: {step.transform} at '{step.at}', origin {mm} mm", soft_wrap=True)
    read_task(out).graph.check()
    console.print(f"taught: {out}", soft_wrap=True)


@contextmanager
def _placing(rig: Rig, poses: Path | None) -> Generator[Placed]:
    if poses is not None:
        recorded = recorded_poses(poses, rig.n_joints)

        def by_file(position: str) -> Floats:
            if position not in recorded:
                raise TaskError(f"{poses}: no row for '{position}'; it has {', '.join(recorded) or 'none'}")
            return recorded[position]

        yield by_file
        return
    asking = someone(at_terminal(), "to place the arm", "give recorded positions with --poses")
    with watched_joints(rig, SystemClock()) as joints:

        def by_operator(position: str) -> Floats:
            if not asking.enter(f"Place the arm at '{position}', and let it rest."):
                raise NotAgreedError(f"teaching ended before '{position}'; what was taught until then is kept")
            return joints()

        yield by_operator


def recorded_poses(path: Path, n_joints: int) -> dict[str, Floats]:
    """Readings (joint,) rad by position, from a CSV. TaskError names file, row and column."""
    rows = list(csv.DictReader(read_text(path, "pose table", TaskError).splitlines()))
    found: dict[str, Floats] = {}
    for number, row in enumerate(rows, start=2):
        values: list[float] = []
        for joint in range(1, n_joints + 1):
            rad, deg = row.get(f"q{joint}_rad"), row.get(f"q{joint}_deg")
            text, unit = (rad, 1.0) if rad else (deg, math.pi / 180.0)
            try:
                values.append(float(text or "") * unit)
            except ValueError:
                raise TaskError(
                    f"{path}, line {number}: joint {joint} is {text!r}; give it as q{joint}_deg or q{joint}_rad"
                ) from None
        name = (row.get("at") or "").strip()
        if not name or not np.isfinite(values).all():
            raise TaskError(
                f"{path}, line {number}: a row is a position in column 'at' and {n_joints} finite joint readings"
            )
        found[name] = np.array(values)
    return found


def run_by_hand(
    rig: Rig, file: Path, out: Path, model: Path | None, speed: float, console: Console, *, dry: bool, yes: bool
) -> None:
    """The whole program, or with `dry` its first plan.

    TaskError before a device is opened where something is missing; NotAgreedError, RefusedMotionError before anything
    moves; InterruptedMotionError, DeviceError in the motion: the arm stands then.
    """
    task = read_task(file)
    camera = rig.camera is not None and rig.camera.calibration is not None
    if lacking := missing(task, camera=camera):
        for line in lacking:
            console.print(f"missing: {line}", soft_wrap=True, markup=False, highlight=False)
        raise TaskError(f"{file}: the program is not ready, what it lacks is listed above; nothing was moved")
    asking = None if yes or dry else someone(at_terminal(), "whether the arm may move", YES)
    clock, solver = SystemClock(), solver_of(rig, model)
    with streamed_robot(rig, clock) as robot:
        gate = gate_of(rig, solver, robot.arm, clock, speed)
        plans = _Plans(rig, out, console)
        segments, count = next_sweep(task.graph, tuple(unrolled(task.program)))
        if segments:
            first = gate.plan(robot.joints(), segments)
            plans.show(first)
            plans.agreed = first
        if dry:
            console.print(_unplanned(task, count), soft_wrap=True)
            return
        if asking is not None:
            asking.may_move()
        with open_task_devices(task, file.parent, rig, robot, clock) as devices, keys_of(gate) as keys:
            watch = keys.alongside(robot.supervisor.check)
            around = Around(robot.joints, devices.read, devices.act, devices.belt, watch, plans.show)
            ran = run_task(gate, task, around)
    (_, q_rad), host_s = robot.track.joints(), robot.track.host_s()
    seen = [(made, q_rad[(host_s >= one.from_s) & (host_s <= one.to_s)]) for made, one in ran.sweeps]
    console.print(_ran([followed for _, followed in ran.sweeps]), soft_wrap=True)
    console.print(_off(deviation(seen)), rates_text(rig.motion.structural_hz, UR_STREAM_HZ), sep="\n", soft_wrap=True)


@dataclass
class _Plans:
    """Draws and prints each motion before it is made; the first is shown before the question, then planned again."""

    rig: Rig
    out: Path
    console: Console
    agreed: Plan | None = None  # shown already, and not made yet
    _count: int = 0

    def show(self, made: Plan) -> None:
        """RefusedMotionError where the arm was moved since the plan that was agreed to."""
        agreed, self.agreed = self.agreed, None
        if agreed is not None:
            if np.max(np.abs(made.start_rad - agreed.start_rad)) > MOVED_RAD:
                raise RefusedMotionError("the arm was moved after its plan was shown; nothing was moved: run it again")
            return
        self._count += 1
        file = self.out / f"plan-{self._count}.svg"
        draw_plan_file(made, cell_of(self.rig), file)
        self.console.print(said(made, file), soft_wrap=True)


def _unplanned(task: Task, count: int) -> str:
    rest = len(tuple(unrolled(task.program))) - count
    behind = f"; {rest} steps from the first READ on are planned once it has been read" if rest else ""
    return f"nothing was moved{behind}"


def _off(found: Deviation | None) -> str:
    if found is None:
        return "off the plan: not compared, the whole way was led by a belt, or the controller reported nothing"
    return f"off the plan: largest {1e3 * found.largest_m:.3f} mm, rms {1e3 * found.rms_m:.3f} mm, square to its way"


def _ran(sweeps: list[Followed]) -> str:
    sent, missed = sum(one.sent for one in sweeps), sum(one.missed for one in sweeps)
    many = "" if len(sweeps) == 1 else "s"
    return f"the program ran to its end: {len(sweeps)} motion{many}, {sent} set-points, {missed} cycles missed"
