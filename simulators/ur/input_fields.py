"""Every input variable a client may write: its type, and what writing it does.

The external force-torque is accepted and kept, without effect on the emulated world.
Source of names and types: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", table of controller inputs.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from simulators.ur.registers import N_BITS, N_REGISTERS, Memory

SETTINGS = {
    "speed_slider_mask": "UINT32",
    "speed_slider_fraction": "DOUBLE",
    "standard_digital_output_mask": "UINT8",
    "standard_digital_output": "UINT8",
    "configurable_digital_output_mask": "UINT8",
    "configurable_digital_output": "UINT8",
    "tool_digital_output_mask": "UINT8",
    "tool_digital_output": "UINT8",
    "standard_analog_output_mask": "UINT8",
    "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE",
    "standard_analog_output_1": "DOUBLE",
    "external_force_torque": "VECTOR6D",
}
REGISTER = re.compile(r"input_(int|double|bit)_register_(\d+)")


@dataclass(frozen=True)
class InputField:
    """A variable: its RTDE type and how it is written (one number, or a tuple for a vector)."""

    type_name: str
    write: Callable[[Any], None]


def input_field(name: str, memory: Memory) -> InputField | None:
    """The variable of that name, None when there is none (the controller then answers NOT_FOUND)."""
    if name in SETTINGS:
        return InputField(SETTINGS[name], lambda value: memory.settings.__setitem__(name, value))
    if name == "input_bit_registers0_to_31":
        return InputField("UINT32", lambda value: memory.inputs.set_word(0, value))
    if name == "input_bit_registers32_to_63":
        return InputField("UINT32", lambda value: memory.inputs.set_word(32, value))
    match = REGISTER.fullmatch(name)
    return None if match is None else _register_field(match[1], int(match[2]), memory)


def _register_field(kind: str, index: int, memory: Memory) -> InputField | None:
    if kind == "int" and index < N_REGISTERS:
        return InputField("INT32", lambda value: memory.write_int(index, value))
    if kind == "double" and index < N_REGISTERS:
        return InputField("DOUBLE", lambda value: memory.inputs.doubles.__setitem__(index, value))
    if kind == "bit" and 64 <= index < N_BITS:
        return InputField("BOOL", lambda value: memory.inputs.set_bit(index, value))
    return None
