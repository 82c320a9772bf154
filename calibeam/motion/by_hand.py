"""One motion by hand: planned, drawn, shown to the person, driven when they agree."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from acquisition.motion.cell import Cell
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.solver import Solver
from acquisition.motion.paths.segments import Segment
from acquisition.motion.plan import Plan
from acquisition.recording.rig import Rig
from calibeam.asking import YES, Asking, at_terminal, someone
from calibeam.motion.gate_of_rig import cell_of, gate_of, solver_of
from calibeam.motion.keys import keys_of
from calibeam.motion.robot import streamed_robot
from drivers.clock import SystemClock

Floats = NDArray[np.float64]
Asked = Callable[[Solver, Floats], list[Segment]]  # from where the arm stands to the motion


@dataclass(frozen=True)
class Agreement:
    """What has to happen before the arm moves."""

    plan_file: Path  # the drawing of the plan
    yes: bool = False  # nobody is asked
    dry: bool = False  # nothing is moved
    speed_share: float = 1.0


def move_by_hand(rig: Rig, model: Path | None, asked: Asked, agreement: Agreement, console: Console) -> Floats:
    """Plan, draw, ask, move; the readings (joint,) in the end.

    NotAgreedError, RefusedMotionError before anything moves; InterruptedMotionError, DeviceError in the motion: the arm
    stands then.
    """
    asking: Asking | None = None
    if not (agreement.yes or agreement.dry):
        asking = someone(at_terminal(), "whether the arm may move", f"{YES} (--dry-run plans and draws only)")
    clock, solver = SystemClock(), solver_of(rig, model)
    with streamed_robot(rig, clock) as robot:
        gate = gate_of(rig, solver, robot.arm, clock, agreement.speed_share)
        now_rad = robot.joints()
        made = gate.plan(now_rad, asked(solver, now_rad))
        draw_plan_file(made, cell_of(rig), agreement.plan_file)
        console.print(_said(made, agreement.plan_file), soft_wrap=True)
        if agreement.dry:
            console.print("nothing was moved")
            return now_rad
        if asking is not None:
            asking.may_move()
        return _drive(gate, made, robot.joints, robot.supervisor.check, console)


def _drive(gate: Gate, made: Plan, joints: Callable[[], Floats], watch: Callable[[], None], console: Console) -> Floats:
    now_rad = joints()
    with keys_of(gate):
        followed = gate.run(made, now_rad, watch=watch)
    end_rad = joints()
    off = float(np.max(np.abs(end_rad - made.q_rad[-1])))
    console.print(
        f"{gate.state.value}; {followed.sent} set-points, {followed.missed} cycles missed; joints now "
        f"{np.round(np.degrees(end_rad), 3).tolist()} deg, {np.degrees(off):.4f} deg from the plan's end",
        soft_wrap=True,
    )
    return end_rad


def _said(made: Plan, plan_file: Path) -> str:
    speed, _ = made.rates()
    fastest = int(np.argmax(np.max(np.abs(speed), axis=0)))
    names = ", ".join(f"{segment.name} ({segment.by.value})" for segment in made.segments)
    return (
        f"plan: {names}; {made.t_s[-1]:.1f} s, fastest joint {fastest + 1} at "
        f"{np.degrees(np.max(np.abs(speed[:, fastest]))):.1f} deg/s; drawn in {plan_file}"
    )


def draw_plan_file(made: Plan, cell: Cell, path: Path) -> None:
    """A plan that was not driven yet, as SVG."""
    from calibeam.motion import figures  # matplotlib takes a second to load

    path.parent.mkdir(parents=True, exist_ok=True)
    figures.write_figure(path, 12.0, 4.0, lambda figure: figures.draw_plan(figure, made, made.solver, cell))
