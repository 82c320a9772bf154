"""URScript as far as clients of this emulator send it: the control program of ur_rtde, and plain lines of moves.

What it does not imitate: URScript as a language. Branches, loops, variables, threads, user functions, `sec` programs,
movep, movec are refused as a whole program; the list of known calls is KNOWN_CALLS.
"""

import ast
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

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
        """The argument that says where to. ScriptRefused when there is none."""
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
