"""URScript as far as clients of this emulator send it: the control program of ur_rtde, and plain lines of moves.

A program of plain lines runs one call after the other, each to its end. What it does not imitate: URScript as a
language. Branches, loops, variables, threads, user functions, `sec` programs, movep, movec are refused as a whole
program; the list of known calls is KNOWN_CALLS.
"""

import ast
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

from simulators.ur.controller_kinematics import Frame, frame_of
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.moves import Leg
from simulators.ur.program import Wait
from simulators.ur.registers import N_BITS, N_REGISTERS, Memory

KNOWN_CALLS = frozenset(
    {
        "movej", "movel", "stopj", "stopl", "servoj", "speedj", "speedl", "sleep", "sync", "textmsg", "popup",
        "set_tcp", "set_payload", "set_target_payload", "set_gravity", "zero_ftsensor", "set_standard_digital_out",
        "set_digital_out", "set_configurable_digital_out", "set_tool_digital_out", "set_standard_analog_out",
        "set_analog_out", "set_tool_voltage", "write_output_integer_register", "write_output_float_register",
        "write_output_boolean_register", "signal_async_progress", "protective_stop", "halt",
    }
)  # fmt: skip
INT_OFFSET = re.compile(r"# int register offset\s*(\d+)|reg_offset_int = (\d+)")
FLOAT_OFFSET = re.compile(r"# float register offset\s*(\d+)|reg_offset_float = (\d+)")
CONTROL_PROGRAM = re.compile(r"^def rtde_control\(\):", re.MULTILINE)
PATH_MARK = "# inject move path"


class ScriptRefused(Exception):  # noqa: N818 - the controller refuses the script
    """Text that this controller does not run; the message holds the line."""


@dataclass(frozen=True)
class PoseLiteral:
    """p[x, y, z, rx, ry, rz] in a script."""

    values: tuple[float, ...]


Argument = float | str | tuple[float, ...] | PoseLiteral


@dataclass(frozen=True)
class Call:
    """One line: a function of URScript with its arguments."""

    name: str
    positional: tuple[Argument, ...]
    named: dict[str, Argument]

    def number(self, name: str, position: int, otherwise: float) -> float:
        """A number by its name or position. ScriptRefused when it is something else."""
        value = self.named.get(name, self.positional[position] if position < len(self.positional) else otherwise)
        if not isinstance(value, float):
            raise ScriptRefused(f"{self.name}: {name} is {value!r}, a number is needed")
        return value

    def numbers(self, name: str, position: int, length: int) -> tuple[float, ...] | None:
        """A list of that length by its name or position, None when there is none. ScriptRefused for something else."""
        value = self.named.get(name, self.positional[position] if position < len(self.positional) else None)
        if value is not None and (not isinstance(value, tuple) or len(value) != length):
            raise ScriptRefused(f"{self.name}: {name} is {value!r}, a list of {length} numbers is needed")
        return value

    def first(self) -> Argument:
        """The argument with the goal. ScriptRefused when there is none."""
        if not self.positional:
            raise ScriptRefused(f"{self.name}: no argument")
        return self.positional[0]


@dataclass(frozen=True)
class UploadedControl:
    """ur_rtde's control script: the registers it uses, and the path that was injected into it."""

    int_offset: int
    float_offset: int
    path: tuple[Call, ...]
    has_dynamics: bool  # mass matrix, Jacobian and so on: uploaded to PolyScope 5.23 and later


def is_control_program(text: str) -> bool:
    return CONTROL_PROGRAM.search(text) is not None


def read_control_program(text: str) -> UploadedControl:
    """ScriptRefused when the register offsets are missing, or the path holds a line that cannot be run."""
    offsets = [pattern.search(text) for pattern in (INT_OFFSET, FLOAT_OFFSET)]
    numbers = [next((int(group) for group in match.groups() if group), None) for match in offsets if match]
    if len(numbers) != 2 or numbers[0] is None or numbers[1] is None:
        raise ScriptRefused("control program without register offsets")
    return UploadedControl(numbers[0], numbers[1], _injected_path(text), "get_mass_matrix()" in text)


def read_lines(text: str) -> tuple[Call, ...]:
    """The calls of a bare line or of a `def name(): ... end` program. ScriptRefused for anything else."""
    lines = [line.strip() for line in text.splitlines()]
    body = [line for line in lines if line and not line.startswith("#")]
    if body and body[0].startswith("def "):
        if body[-1] != "end":
            raise ScriptRefused(f"program without its end: {body[-1]!r}")
        body = body[1:-1]
    return tuple(_read_call(line) for line in body)


def _injected_path(text: str) -> tuple[Call, ...]:
    _, mark, after = text.partition(PATH_MARK)
    calls: list[Call] = []
    for line in after.splitlines()[1:] if mark else []:
        if not line.strip().startswith(("movej", "movel", "movep", "movec", "signal_async_progress")):
            break
        calls.append(_read_call(line.strip()))
    return tuple(calls)


def _read_call(line: str) -> Call:
    try:
        node = ast.parse(line, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        raise ScriptRefused(f"line {line[:80]!r} is not a call that this emulator knows") from error
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name) or node.func.id not in KNOWN_CALLS:
        raise ScriptRefused(f"line {line[:80]!r} is not a call that this emulator knows")
    named = {keyword.arg: _value(keyword.value, line) for keyword in node.keywords if keyword.arg is not None}
    return Call(node.func.id, tuple(_value(argument, line) for argument in node.args), named)


def _value(node: ast.expr, line: str) -> Argument:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.Name) and node.id in ("True", "False"):
        return float(node.id == "True")
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "p":
        pose = _numbers(node.slice, line)
        if len(pose) != 6:
            raise ScriptRefused(f"line {line[:80]!r}: a pose has six numbers, here are {len(pose)}")
        return PoseLiteral(pose)
    if isinstance(node, ast.List):
        return _numbers(node, line)
    return _number(node, line)


def _numbers(node: ast.expr, line: str) -> tuple[float, ...]:
    elements = cast(Sequence[ast.expr], getattr(node, "elts", ()))
    return tuple(_number(element, line) for element in elements)


def _number(node: ast.expr, line: str) -> float:
    """A number, with signs, or the sum that ur_rtde writes for a register (0 + 24)."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and math.isfinite(node.value):
        return float(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -_number(node.operand, line)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _number(node.left, line) + _number(node.right, line)
    raise ScriptRefused(f"line {line[:80]!r}: a number cannot be read")


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
            case _:  # textmsg, popup, sync, signal_async_progress: nobody to inform
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
