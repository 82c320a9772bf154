"""One motion by hand: planned, drawn, shown to the person, driven when they agree; stopped by Ctrl-C and keys.

First Ctrl-C: rest at the next place, or brake along the path where that is further than a second. Again: brake, where
it does not brake yet, then give up. SIGTERM and a closed terminal give up at once. While the motion is held a line is
read: r resume, s stop, a abort, h halt.
"""

import signal
import sys
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import InterruptedMotionError, TaskError
from acquisition.motion.cell import Cell
from acquisition.motion.gate import Gate
from acquisition.motion.inverse.solve import Solver
from acquisition.motion.paths.segments import Segment
from acquisition.motion.plan import Plan
from acquisition.motion.states import OVER, MotionState
from acquisition.recording.rig import Rig
from calibeam.asking import YES, Asking, at_terminal, someone
from calibeam.console import Console
from calibeam.motion.gate_of_rig import cell_of, gate_of, solver_of
from calibeam.motion.robot import streamed_robot
from calibeam.outcome import INTERRUPTS, heard_by
from drivers.clock import SystemClock
from drivers.errors import DeviceError

ARRIVED_RAD = 1e-3  # a motion that ended as it should stands this near the end of its plan
WORDS = "r resume, s stop, a abort, h halt, then ENTER"


class MotionKeys:
    """What was pressed, handed to the gate."""

    def __init__(self, gate: Gate, asking: Asking | None, out: TextIO) -> None:
        self._gate, self._asking, self._out = gate, asking, out
        self._thread: threading.Thread | None = None
        self._between = False

    def interrupted(self) -> None:
        """Ctrl-C; where nothing is under way, the next motion ends before it begins (`alongside`)."""
        if self._gate.state in OVER:
            self._between = True
            print("\nnothing moves now, and nothing will: the program ends", file=self._out, flush=True)
            return
        if self._held():
            self._gate.abort()
            return
        self._gate.pause()
        if self._held():
            message = (
                f"braking along the path, at rest within {self._gate.brake_s:.1f} s; Ctrl-C again gives the motion up"
            )
        else:
            message = f"resting at the next place within {self._gate.rests_in_s():.1f} s; Ctrl-C again brakes now"
        print(f"\n{message}", file=self._out, flush=True)
        self._ask()

    def ended(self) -> None:
        """The process shall end."""
        self._between = self._between or self._gate.state in OVER
        self._gate.abort()

    def alongside(self, watch: Callable[[], None]) -> Callable[[], None]:
        """`watch`, and InterruptedMotionError in a motion that begins after a key or signal came while none did."""

        def both() -> None:
            watch()
            if self._between:
                raise InterruptedMotionError("stopped by hand while nothing moved; the arm stands, the program ends")

        return both

    def word(self, text: str) -> None:
        """One line of the keyboard."""
        word = text.strip().lower()
        ends = {"s": self._gate.stop, "a": self._gate.abort, "h": self._gate.halt}
        act = self._gate.resume if word in ("r", "resume") else ends.get(word[:1])
        if act is None:
            return  # asked again, with the words that there are
        try:
            act()
        except DeviceError as error:
            print(f"{error}", file=self._out, flush=True)

    def _held(self) -> bool:
        return self._gate.state is MotionState.HELD

    def _ask(self) -> None:
        if self._asking is not None and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=self._listen, args=(self._asking,), name="keys", daemon=True)
            self._thread.start()

    def _listen(self, asking: Asking) -> None:
        """Until the motion goes on or ends; the end of input means nothing, for Ctrl-C is still heard."""

        def over() -> bool:
            return self._gate.state not in (MotionState.HELD, MotionState.PAUSING)

        while not over():
            line = asking.ask(WORDS, "> ", over)
            if line is not None:
                self.word(line)
            elif not over():
                return


@contextmanager
def keys_of(gate: Gate) -> Generator[MotionKeys]:
    """Inside, Ctrl-C and SIGTERM speak to the gate instead of ending the program."""
    keys = MotionKeys(gate, at_terminal(), sys.stderr)

    def interrupt(number: int, frame: FrameType | None) -> None:
        keys.interrupted()

    def end(number: int, frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            INTERRUPTS.leave_terminal()
        keys.ended()

    with heard_by({signal.SIGINT: interrupt, signal.SIGTERM: end, signal.SIGHUP: end}):
        try:
            yield keys
        except BaseException:
            INTERRUPTS.close()  # the arm stands, or has the stop command; what is left is to release it
            raise


Floats = NDArray[np.float64]
Asked = Callable[[Solver, Floats], list[Segment]]  # from where the arm stands to the motion


def checked_speed(speed: float) -> float:
    """The speed as a fraction of the rig's own, above 0 and up to 1. TaskError for another."""
    if not 0.0 < speed <= 1.0:
        raise TaskError(f"--speed {speed}: a share of the rig's speeds, above 0 and up to 1")
    return speed


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
        console.print(said(made, agreement.plan_file), soft_wrap=True)
        if agreement.dry:
            console.print("nothing was moved")
            return now_rad
        if asking is not None:
            asking.may_move()
        return _drive(gate, made, robot.joints, robot.supervisor.check, console)


def _drive(gate: Gate, made: Plan, joints: Callable[[], Floats], watch: Callable[[], None], console: Console) -> Floats:
    now_rad = joints()
    with keys_of(gate) as keys:
        followed = gate.run(made, now_rad, watch=keys.alongside(watch))
    end_rad = joints()
    off = float(np.max(np.abs(end_rad - made.q_rad[-1])))
    console.print(
        f"{ending_words(gate.state, off)}; {followed.sent} set-points, {followed.missed} cycles missed; joints now "
        f"{(np.round(np.degrees(end_rad), 3) + 0.0).tolist()}°, {np.degrees(off):.4f}° from the plan's end",
        soft_wrap=True,
    )
    return end_rad


def ending_words(state: MotionState, off_rad: float) -> str:
    """How the motion ended; `off_rad`: the farthest joint from the end of the plan."""
    if state is MotionState.DONE and off_rad > ARRIVED_RAD:
        return "stopped on request before the end of the plan"
    return state.value


def said(made: Plan, plan_file: Path) -> str:
    """A plan in one line for the terminal."""
    speed, _ = made.rates()
    fastest = int(np.argmax(np.max(np.abs(speed), axis=0)))
    names = ", ".join(f"{segment.name} ({segment.by.value})" for segment in made.segments)
    return (
        f"plan: {names}; {made.t_s[-1]:.1f} s, fastest joint {fastest + 1} at "
        f"{np.degrees(np.max(np.abs(speed[:, fastest]))):.1f}°/s; drawn in {plan_file}"
    )


def draw_plan_file(made: Plan, cell: Cell, path: Path) -> None:
    """A plan that was not driven yet, as SVG."""
    from calibeam.motion import figures  # matplotlib takes a second to load

    path.parent.mkdir(parents=True, exist_ok=True)
    figures.write_figure(path, 12.0, 4.0, lambda figure: figures.draw_plan(figure, made, made.solver, cell))
