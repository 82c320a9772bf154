"""A program of plain URScript lines: one call after the other, each to its end."""

from collections.abc import Sequence

from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.moves import Leg
from simulators.ur.poses import Frame, frame_of
from simulators.ur.program import Wait
from simulators.ur.registers import N_BITS, N_REGISTERS, Memory
from simulators.ur.script_text import Argument, Call, PoseLiteral, ScriptRefused

MOVEJ_DEFAULTS = (1.4, 1.05)  # acceleration, speed: URScript manual, movej
DIGITAL_OUTPUTS = {  # first bit and number (URScript manual; set_digital_out counts through all three kinds)
    "set_standard_digital_out": (0, 8),
    "set_configurable_digital_out": (8, 8),
    "set_tool_digital_out": (16, 2),
    "set_digital_out": (0, 18),
}
MOVEL_DEFAULTS = (1.2, 0.25)  # URScript manual, movel


class LineProgram:
    """Runs calls in order; ScriptRefused is turned into MoveRefused, so that it ends the program."""

    def __init__(self, calls: Sequence[Call], arm: ArmController, memory: Memory) -> None:
        self._calls, self._arm, self._memory = list(calls), arm, memory
        self._wait: Wait | None = None
        self._now_s = 0.0

    def step(self, t_s: float) -> bool:
        self._now_s = t_s
        while self._wait is None or self._wait():
            if not self._calls:
                return False
            try:
                self._wait = self._run(self._calls.pop(0))
            except ScriptRefused as refused:
                raise MoveRefused(str(refused)) from refused
        return True

    def halt(self) -> None:
        """Nothing to put right: the runner stops the arm."""

    def _run(self, call: Call) -> Wait:
        match call.name:
            case "movej" | "movel":
                self._arm.move_path([leg_of(call, self._arm)])
                return lambda: not self._arm.moving
            case "stopj":
                self._arm.stop(call.number("a", 0, 2.0))
                return lambda: not self._arm.moving
            case "stopl":
                self._arm.stop_tool(call.number("a", 0, 2.0))
                return lambda: not self._arm.moving
            case "servoj":
                return self._servo(call)
            case "speedj" | "speedl":
                return self._speed(call)
            case "sleep":
                return self._after(call.number("t", 0, 0.0))
            case _:
                self._set(call)
                return lambda: True

    def _servo(self, call: Call) -> Wait:
        lookahead_s, gain = call.number("lookahead_time", 4, 0.1), call.number("gain", 5, 300.0)
        self._arm.servo_joints(six(call.first()), lookahead_s, gain)
        return self._after(call.number("t", 3, 0.002))

    def _speed(self, call: Call) -> Wait:
        verb = self._arm.speed_joints if call.name == "speedj" else self._arm.speed_tool
        verb(six(call.first()), call.number("a", 1, 1.2))
        return self._after(call.number("t", 2, 0.0))

    def _set(self, call: Call) -> None:
        outputs = self._memory.outputs
        match call.name:
            case "set_tcp":
                self._arm.T_flange_tool = frame_of(six(call.first()))
            case "set_payload" | "set_target_payload":
                self._memory.installation.payload_kg = call.number("m", 0, 0.0)
                self._memory.installation.payload_cog_m = call.numbers("cog", 1, 3) or self._arm.T_flange_tool[9:]
            case "set_gravity":
                self._memory.installation.gravity_m_s2 = call.numbers("d", 0, 3) or (0.0, 0.0, 9.82)
            case "zero_ftsensor":
                T_base_flange = self._arm.arm.forward(self._arm.joints.q_rad.tolist())[0]
                self._arm.dynamics.zero_sensor(T_base_flange, self._memory.installation)
            case "set_tool_voltage":
                self._memory.tool_voltage_v = int(call.number("voltage", 0, 0.0))
            case "set_standard_analog_out" | "set_analog_out":
                self._memory.set_analog_output(_below(call, 2), None, call.number("f", 1, 0.0))
            case name if name in DIGITAL_OUTPUTS:
                low, count = DIGITAL_OUTPUTS[name]
                bit = 1 << (low + _below(call, count))
                self._memory.set_digital_outputs(bit, bit if call.number("b", 1, 0.0) else 0)
            case "protective_stop":
                self._arm.protective_stop("protective_stop() in a script")
            case "halt":
                self._calls.clear()
            case "write_output_integer_register":
                outputs.ints[_below(call, N_REGISTERS)] = int(call.number("value", 1, 0.0))
            case "write_output_float_register":
                outputs.doubles[_below(call, N_REGISTERS)] = call.number("value", 1, 0.0)
            case "write_output_boolean_register":
                outputs.set_bit(_below(call, N_BITS), bool(call.number("value", 1, 0.0)))
            case _:  # textmsg, popup, sync, signal_async_progress: nobody to tell
                pass

    def _after(self, delay_s: float) -> Wait:
        until_s = self._now_s + delay_s
        return lambda: self._now_s >= until_s - 1e-9


def leg_of(call: Call, arm: ArmController) -> Leg:
    """One movej or movel of a script as a leg. ScriptRefused for other calls, MoveRefused for impossible numbers."""
    goal = call.first()
    if call.name == "movej":
        a, v = (call.number(name, index, MOVEJ_DEFAULTS[index - 1]) for index, name in ((1, "a"), (2, "v")))
        return arm.joint_leg(_joints(goal, arm), v, a)
    if call.name == "movel":
        a, v = (call.number(name, index, MOVEL_DEFAULTS[index - 1]) for index, name in ((1, "a"), (2, "v")))
        return arm.line_leg(_tool_frame(goal, arm), v, a)
    raise ScriptRefused(f"{call.name} in a path is not emulated")


def six(argument: Argument) -> tuple[float, ...]:
    """Six numbers of a list or of a pose. ScriptRefused otherwise."""
    if isinstance(argument, PoseLiteral):
        return argument.values
    if isinstance(argument, tuple) and len(argument) == 6:
        return argument
    raise ScriptRefused(f"{argument!r}: six numbers are needed")


def _joints(goal: Argument, arm: ArmController) -> Sequence[float]:
    if not isinstance(goal, PoseLiteral):
        return six(goal)
    return arm.inverse(frame_of(goal.values)).tolist()


def _tool_frame(goal: Argument, arm: ArmController) -> Frame:
    return frame_of(six(goal)) if isinstance(goal, PoseLiteral) else arm.arm.tool(six(goal), arm.T_flange_tool)


def _below(call: Call, count: int) -> int:
    """The number of an output or a register, the first argument. ScriptRefused outside 0..count - 1."""
    index = int(call.number("n", 0, 0.0))
    if not 0 <= index < count:
        raise ScriptRefused(f"{call.name}: number {index}; there are 0..{count - 1}")
    return index
