"""What ur_rtde's uploaded control script does: a command register in, a state register out, once per cycle.

The script itself (URScript, 42 kB) is not interpreted: this is its behaviour, for PolyScope 5.12 to 5.25. Not
imitated: its text messages, its threads (a new motion replaces the one before, where two threads would fight), and that
it ignores a stop sent while a command of a client that has died is still carried out: it ends after that command.
Source: the control script of ur_rtde 1.6.5: main loop, `process_cmd`, `exec_stopl_stopj`, `contact_thread`,
`write_async_progress_register`.
"""

import math
from collections.abc import Sequence

from simulators.ur.commands import COMMANDS
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.moves import Floats, Leg
from simulators.ur.program import Wait
from simulators.ur.registers import Memory
from simulators.ur.script_program import ScriptRefused, UploadedControl, leg_of
from simulators.wire import TICK_S

READY, DONE = 1, 2
IDLE_COMMAND, STOP_SCRIPT_COMMAND = 0, 255
COMMAND, STATE, PROGRESS = 0, 0, 2  # integer registers
MATRIX_REGISTERS = (*range(24), *range(36, 48))  # column by column
CONTACT_DECELERATION_M_S2 = 3.0  # of stopl after a contact
CONTACT_LINE = (0.25, 1.2)  # speed [m/s] and acceleration [m/s^2] back to it: the defaults of movel
# executed every cycle while present, and never answered with "done"
REALTIME_COMMANDS = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71})

RUNNING = 1 << 15
COUNTER_LIMIT = 127


class ControlScript:
    """The program behind RTDEControlInterface."""

    def __init__(self, uploaded: UploadedControl, arm: ArmController, memory: Memory) -> None:
        """ScriptRefused or MoveRefused when the injected path cannot be run."""
        self.arm, self.memory = arm, memory
        self.tool_speed_mode = False  # the last speed command was speedl, not speedj
        self.has_dynamics = uploaded.has_dynamics
        self.contact_step_back = 0  # cycles since the tool touched first, of the last contact that was watched for
        self._touched_steps = 0
        self._asked_s = -math.inf
        self._watched: list[float] | None = None  # direction of the contact that is watched for
        self._was_free = False  # no contact since the watch began
        self._contact_came = False
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

    def answer_matrix(self, matrix: Floats) -> None:
        """36 results of (6, 6). MoveRefused with the upper registers, where the script writes beyond the last one."""
        if self._doubles:
            raise MoveRefused(f"write_output_float_register: register {self._doubles + MATRIX_REGISTERS[-1]}")
        for register, value in zip(MATRIX_REGISTERS, matrix.T.ravel().tolist(), strict=True):
            self.memory.outputs.doubles[register] = value

    # --- contact

    def contact_steps(self, direction: Sequence[float]) -> int:
        """Cycles back to just before a contact, 0 without one (URScript, tool_contact). To be asked once a cycle."""
        touches = self.arm.dynamics.touches(self.arm.T_flange_tool, direction)
        goes_on = self._now_s - self._asked_s < 1.5 * TICK_S  # asked in the cycle before, too
        self._asked_s = self._now_s
        self._touched_steps = (self._touched_steps if goes_on else 0) + 1 if touches else 0
        return self._touched_steps

    def back_to_contact(self, steps: int) -> Wait:
        """Brakes, then returns on a straight line to where the joints were `steps` cycles ago: just before it."""
        history = self.arm.history_rad  # its newest is of the cycle before this one
        goal = self.arm.arm.tool(history[-min(steps, len(history))].tolist(), self.arm.T_flange_tool)
        self.arm.stop_tool(CONTACT_DECELERATION_M_S2)
        returning = False

        def done() -> bool:
            nonlocal returning
            if self.arm.moving:
                return False
            if returning:
                return True
            self.arm.move_path([self.arm.line_leg(goal, *CONTACT_LINE)])
            returning = True
            return False

        return done

    def watch_contact(self, direction: Sequence[float] | None) -> None:
        """From now on a contact ends an asynchronous motion; None ends the watch."""
        self._watched = None if direction is None else list(direction)
        if direction is not None:
            self.contact_step_back, self._was_free, self._contact_came = 0, False, False

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
        self._look_for_contact()
        if self._wait is not None:
            if self._wait():
                self._wait = None
                self._say(DONE)
            return True
        return self._obey(self.integer(COMMAND))

    def halt(self) -> None:
        self.arm.freedrive = False
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

    def _look_for_contact(self) -> None:
        """The script's own thread: waits until the tool is free, then until it touches."""
        if self._watched is None:
            return
        # the script tests the sum: a negative direction counts as none, and the tool's motion is taken
        direction = self._watched if sum(self._watched) >= 1e-10 else self._target_direction()
        steps = self.contact_steps(direction)
        self._was_free = self._was_free or not steps
        if steps and self._was_free:
            self.contact_step_back, self._contact_came, self._watched = steps, True, None

    def _target_direction(self) -> Sequence[float]:
        setpoint = self.arm.setpoint
        J, _ = self.arm.arm.jacobian(setpoint.q_rad.tolist(), self.arm.T_flange_tool)
        return (J @ setpoint.qd_rad_s)[:3].tolist()

    def _obey(self, command: int) -> bool:
        if command in REALTIME_COMMANDS:
            self._process(command)
            self._say(READY)
        elif command == IDLE_COMMAND and self._contact_came and not self._executing:
            self._contact_came, self._executing = False, True
            self.end_async()
            self._wait = self.back_to_contact(self.contact_step_back)
        elif command == IDLE_COMMAND:
            self._executing = False
            self._say(READY)
        elif command == STOP_SCRIPT_COMMAND:  # even if who died never took its command back: else the next waits 300 s
            return False
        elif not self._executing:
            self._executing = True
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


class AsyncStatus:
    """The progress word, output integer register 2.

    Bits 0-14 progress, bit 15 running, bits 16-23 write counter, bits 24-30 operation id, both counting 0..127. Every
    change counts up, so that a client sees even an operation that is shorter than its cycle.
    """

    def __init__(self) -> None:
        self._writes = 0
        self._operation = 0

    def started(self) -> int:
        self._operation = 0 if self._operation == COUNTER_LIMIT else self._operation + 1
        return self._word(RUNNING)

    def progress(self, value: int) -> int:
        """`value`: what the program reports, for a path the index of the leg."""
        return self._word(RUNNING | min(max(value, 0), RUNNING - 1))

    def finished(self) -> int:
        return self._word(0)

    def _word(self, low: int) -> int:
        self._writes = 0 if self._writes == COUNTER_LIMIT else self._writes + 1
        return low | (self._writes << 16) | (self._operation << 24)
