"""What ur_rtde's uploaded control script does: a command register in, a state register out, once per cycle.

The script itself (URScript, 42 kB) is not interpreted: this is its behaviour, for PolyScope 5.12. Not imitated: its
text messages, its threads (a new motion replaces the one before, where two threads would fight), and commands 66 to
71, which the script for 5.12 does not hold either.
Source: the control script of ur_rtde 1.6.5: main loop, `process_cmd`, `exec_stopl_stopj`.
"""

from collections.abc import Sequence

from simulators.ur.async_status import AsyncStatus
from simulators.ur.commands import COMMANDS
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.moves import Leg
from simulators.ur.program import Wait
from simulators.ur.registers import Memory
from simulators.ur.script_program import leg_of
from simulators.ur.script_text import ScriptRefused, UploadedControl

READY, DONE = 1, 2
IDLE_COMMAND, STOP_SCRIPT_COMMAND = 0, 255
COMMAND, STATE, PROGRESS = 0, 0, 2  # integer registers
# executed every cycle while present, and never answered with "done"
REALTIME_COMMANDS = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71})


class ControlScript:
    """The program behind RTDEControlInterface."""

    def __init__(self, uploaded: UploadedControl, arm: ArmController, memory: Memory) -> None:
        """ScriptRefused or MoveRefused when the injected path cannot be run."""
        self.arm, self.memory = arm, memory
        self.tool_speed_mode = False  # the last speed command was speedl, not speedj
        self._ints, self._doubles = uploaded.int_offset, uploaded.float_offset
        self._path = [call for call in uploaded.path if call.name != "signal_async_progress"]
        self._status = AsyncStatus()
        self._async_running = False
        self._reported_leg = 0
        self._executing = False
        self._wait: Wait | None = None
        self._begun = False
        self._now_s = self._heard_s = 0.0
        self._silence_limit_s = 0.0  # of the watchdog; 0: none armed
        self._legs = self._path_legs()  # refused before anything runs
        memory.on_int_written.append(self._hear)

    # --- registers, as the commands see them

    def number(self, index: int) -> float:
        return self.memory.inputs.doubles[self._doubles + index]

    def numbers(self, first: int, count: int = 6) -> list[float]:
        return self.memory.inputs.doubles[self._doubles + first : self._doubles + first + count]

    def integer(self, index: int) -> int:
        return self.memory.inputs.ints[self._ints + index]

    def answer(self, values: Sequence[float]) -> None:
        """Results from double register 0 on."""
        self.memory.outputs.doubles[self._doubles : self._doubles + len(values)] = values

    def answer_integer(self, value: int) -> None:
        self.memory.outputs.ints[self._ints + 1] = value

    # --- program

    def step(self, t_s: float) -> bool:
        self._now_s = t_s
        if not self._begun:
            self._begun, self._heard_s = True, t_s
            self._report(self._status.finished())
        if 0.0 < self._silence_limit_s < t_s - self._heard_s:
            raise MoveRefused(
                f"watchdog: no command for {t_s - self._heard_s:.2f} s, limit {self._silence_limit_s:.2f} s"
            )
        self._watch_async()
        if self._wait is not None:
            if self._wait():
                self._wait = None
                self._say(DONE)
            return True
        return self._obey(self.integer(COMMAND))

    def halt(self) -> None:
        self.memory.on_int_written.remove(self._hear)

    def arm_watchdog(self, min_frequency_hz: float) -> None:
        """The program stops when the command register is not written that often."""
        self._silence_limit_s = 1.0 / min_frequency_hz if min_frequency_hz > 0.0 else 0.0
        self._heard_s = self._now_s

    def begin(self, legs: Sequence[Leg], is_async: bool) -> Wait | None:
        """Starts moves; waits for their end unless they are asynchronous."""
        self.end_async()
        self.arm.move_path(legs)
        return self._end_of_motion(is_async)

    def begin_path(self, is_async: bool) -> Wait | None:
        return self.begin(self._legs, is_async)

    def stop(self, is_tool: bool, deceleration: float, is_async: bool) -> Wait | None:
        """Brakes along the tool's line or in the joints, as `exec_stopl_stopj` does."""
        self.end_async()
        if is_tool:
            self.arm.stop_tool(deceleration)
        else:
            self.arm.stop(deceleration)
        return self._end_of_motion(is_async)

    def end_async(self) -> None:
        if self._async_running:
            self._async_running = False
            self._report(self._status.finished())

    # --- inside

    def _end_of_motion(self, is_async: bool) -> Wait | None:
        if not is_async:
            return self.stands
        self._async_running = True
        self._report(self._status.started())
        return None

    def stands(self) -> bool:
        return not self.arm.moving

    def _watch_async(self) -> None:
        if not self._async_running:
            return
        if not self.arm.moving:
            self.end_async()
        elif self.arm.path_leg != self._reported_leg:
            self._reported_leg = self.arm.path_leg
            self._report_word(self._status.progress(self.arm.path_leg))

    def _obey(self, command: int) -> bool:
        if command in REALTIME_COMMANDS:
            self._process(command)
            self._say(READY)
        elif command == IDLE_COMMAND:
            self._executing = False
            self._say(READY)
        elif not self._executing:
            self._executing = True
            if command == STOP_SCRIPT_COMMAND:
                return False
            self._wait = self._process(command)
            if self._wait is None:
                self._say(DONE)
        return True

    def _process(self, command: int) -> Wait | None:
        handler = COMMANDS.get(command)
        return None if handler is None else handler(self)

    def _path_legs(self) -> list[Leg]:
        try:
            return [leg_of(call, self.arm) for call in self._path]
        except ScriptRefused as refused:
            raise MoveRefused(str(refused)) from refused

    def _hear(self, index: int) -> None:
        if index == self._ints + COMMAND:
            self._heard_s = self._now_s

    def _say(self, state: int) -> None:
        self.memory.outputs.ints[self._ints + STATE] = state

    def _report(self, word: int) -> None:
        self._reported_leg = 0
        self._report_word(word)

    def _report_word(self, word: int) -> None:
        self.memory.outputs.ints[self._ints + PROGRESS] = word
