"""Which program runs: start, stop, pause, and the runtime state that clients see.

What is not imitated: the state STOPPING (a stopped program counts as stopped at once, while the arm still brakes), and
the loading time of a long program.
"""

from collections import deque
from collections.abc import Callable
from typing import Protocol

from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.states import RuntimeState

START_DELAY_S = 0.05  # from the last line of a program on the script port to its first cycle; feels right
SCALING_PER_CYCLE = 0.01  # the arm slows down to a lower speed slider, or to a pause, within 0.2 s; feels right
KEPT_FAILURES = 100

Wait = Callable[[], bool]  # True when what was waited for has happened


class Program(Protocol):
    """Something that runs one step a cycle."""

    def step(self, t_s: float) -> bool:
        """False when it has ended. MoveRefused ends it too."""
        ...

    def halt(self) -> None:
        """Informed when it is stopped from outside."""
        ...


class ProgramRunner:
    """The one program slot of the controller."""

    def __init__(self, arm: ArmController) -> None:
        self.state = RuntimeState.STOPPED
        self.last_error = ""  # why the last program ended before its end
        self.n_failures = 0  # programs that were refused or ended in an error
        self._failures: deque[str] = deque(maxlen=KEPT_FAILURES)
        self._arm = arm
        self._program: Program | None = None
        self._starts_s = 0.0
        self._now_s = 0.0

    @property
    def program(self) -> Program | None:
        return self._program

    def fail(self, reason: str) -> None:
        """A program was refused, or ends because of an error."""
        self.last_error = reason
        self._failures.append(reason)
        self.n_failures += 1

    def failures_since(self, count: int) -> list[str]:
        """The reasons of all failures after the first `count`, as far as they are remembered."""
        new = min(self.n_failures - count, len(self._failures))
        return list(self._failures)[len(self._failures) - new :]

    def start(self, program: Program, delay_s: float = START_DELAY_S) -> None:
        """Replaces the running program; refused in silence while the arm may not move, as the script port does."""
        self.stop()
        if not self._arm.power.ready:
            self.last_error = f"program not started: robot {self._arm.power.robot_mode.name}, safety {self._arm.power.safety_mode.name}"  # noqa: E501
            return
        self._program, self.last_error = program, ""
        self._starts_s = self._now_s + delay_s
        if delay_s == 0.0:
            self.state = RuntimeState.PLAYING

    def stop(self) -> None:
        """Works in every state; a moving arm brakes."""
        if self._program is not None:
            self._program.halt()
            self._arm.stop()
        self._program = None
        self.state = RuntimeState.STOPPED

    def pause(self) -> bool:
        """The arm waits on its path; a streamed motion ends. False when no program runs."""
        if self.state is not RuntimeState.PLAYING:
            return False
        self.state = RuntimeState.PAUSED
        self._arm.end_stream()
        return True

    def resume(self) -> bool:
        """False when no program is paused."""
        if self.state is not RuntimeState.PAUSED:
            return False
        self.state = RuntimeState.PLAYING
        return True

    def before_step(self, t_s: float, speed_slider: float) -> None:
        """One cycle of the program; a safety stop ends it."""
        self._now_s = t_s
        self._scale(0.0 if self.state is RuntimeState.PAUSED else speed_slider)
        if self._program is None:
            return
        if not self._arm.power.ready:
            self.last_error = self._arm.stop_reason
            self.stop()
        elif self.state is RuntimeState.STOPPED and t_s >= self._starts_s:
            self.state = RuntimeState.PLAYING
        if self.state is RuntimeState.PLAYING:
            self._step(self._program, t_s)

    def _step(self, program: Program | None, t_s: float) -> None:
        try:
            if program is not None and not program.step(t_s):
                self.stop()
        except MoveRefused as refused:
            self.fail(str(refused))
            self.stop()

    def _scale(self, wanted: float) -> None:
        missing = wanted - self._arm.speed_scaling
        self._arm.speed_scaling += min(max(missing, -SCALING_PER_CYCLE), SCALING_PER_CYCLE)
        if abs(missing) <= SCALING_PER_CYCLE:
            self._arm.speed_scaling = wanted
