"""Every variable that a recipe may name: its type, where an output comes from, and what writing an input does.

Emulated outputs: time, joints (position, speed, current, moment, temperature, mode), tool pose and speed, states, speed
scaling, load, forces at the tool (see dynamics), accelerometer (gravity only), elbow, digital and analog outputs, tool
voltage and registers. target_current, target_moment and joint_control_output repeat the actual values. Plausible
constants: actual_current_window, wrench_calc_from_currents, tool and base accelerations, analog and digital inputs,
tool inputs, voltages and robot current, momentum, execution times, Euromap67, encoder inputs, energies, collision and
deviation ratios. Inputs: the external force-torque is kept, without effect on the emulated world.
Source of names and types: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", tables of controller outputs and
inputs.
"""

import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simulators.ur.readout import Readout
from simulators.ur.registers import N_BITS, N_REGISTERS, Memory, Registers

Source = Callable[[Readout], Any]  # a number, or as many as the type is long


@dataclass(frozen=True)
class Field:
    """A variable: its RTDE type, and its value in one cycle."""

    type_name: str
    read: Source
    constant: float | tuple[float, ...] | None = None  # where the value is always the same


LIVE: dict[str, Field] = {
    "timestamp": Field("DOUBLE", lambda r: r.timestamp_s),
    "control_step": Field("UINT64", lambda r: r.tick),
    "target_q": Field("VECTOR6D", lambda r: r.target_q_rad),
    "target_qd": Field("VECTOR6D", lambda r: r.target_qd_rad_s),
    "target_qdd": Field("VECTOR6D", lambda r: r.target_qdd_rad_s2),
    "target_current": Field("VECTOR6D", lambda r: r.current_a),
    "target_moment": Field("VECTOR6D", lambda r: r.torque_nm),
    "actual_q": Field("VECTOR6D", lambda r: r.q_rad),
    "actual_qd": Field("VECTOR6D", lambda r: r.qd_rad_s),
    "actual_current": Field("VECTOR6D", lambda r: r.current_a),
    "actual_current_as_torque": Field("VECTOR6D", lambda r: r.torque_nm),
    "joint_control_output": Field("VECTOR6D", lambda r: r.current_a),
    "actual_TCP_pose": Field("VECTOR6D", lambda r: r.tool_pose),
    "actual_TCP_speed": Field("VECTOR6D", lambda r: r.tool_speed),
    "target_TCP_pose": Field("VECTOR6D", lambda r: r.target_tool_pose),
    "target_TCP_speed": Field("VECTOR6D", lambda r: r.target_tool_speed),
    "joint_temperatures": Field("VECTOR6D", lambda r: r.temperature_degC),
    "joint_mode": Field("VECTOR6INT32", lambda r: r.joint_mode),
    "robot_mode": Field("INT32", lambda r: r.arm.power.robot_mode),
    "safety_mode": Field("INT32", lambda r: r.arm.power.safety_mode),
    "safety_status": Field("INT32", lambda r: r.arm.power.safety_mode),
    "runtime_state": Field("UINT32", lambda r: r.runtime),
    "robot_status_bits": Field("UINT32", lambda r: r.robot_bits),
    "safety_status_bits": Field("UINT32", lambda r: r.safety_bits),
    "speed_scaling": Field("DOUBLE", lambda r: r.arm.speed_scaling),
    "target_speed_fraction": Field("DOUBLE", lambda r: r.memory.speed_slider),
    "tcp_offset": Field("VECTOR6D", lambda r: r.tool_offset),
    "payload": Field("DOUBLE", lambda r: r.memory.installation.payload_kg),
    "payload_cog": Field("VECTOR3D", lambda r: r.memory.installation.payload_cog_m),
    "payload_inertia": Field("VECTOR6D", lambda r: r.memory.installation.payload_inertia_kg_m2),
    "target_gravity": Field("VECTOR3D", lambda r: r.memory.installation.gravity_m_s2),
    "actual_TCP_force": Field("VECTOR6D", lambda r: r.tool_wrench),
    "ft_raw_wrench": Field("VECTOR6D", lambda r: r.raw_wrench),
    "tcp_force_scalar": Field("DOUBLE", lambda r: math.hypot(*r.tool_wrench[:3])),
    "actual_tool_accelerometer": Field("VECTOR3D", lambda r: r.accelerometer_m_s2),
    "elbow_position": Field("VECTOR3D", lambda r: r.elbow_m),
    "elbow_velocity": Field("VECTOR3D", lambda r: r.elbow_speed_m_s),
    "actual_digital_output_bits": Field("UINT64", lambda r: r.memory.digital_outputs),
    "actual_configurable_digital_output_bits": Field("UINT64", lambda r: (r.memory.digital_outputs >> 8) & 0xFF),
    "analog_io_types": Field("UINT32", lambda r: r.memory.analog_types),
    "standard_analog_output0": Field("DOUBLE", lambda r: r.memory.analog_outputs[0]),
    "standard_analog_output1": Field("DOUBLE", lambda r: r.memory.analog_outputs[1]),
    "tool_output_voltage": Field("INT32", lambda r: r.memory.tool_voltage_v),
    "output_bit_registers0_to_31": Field("UINT32", lambda r: r.memory.outputs.word(0)),
    "output_bit_registers32_to_63": Field("UINT32", lambda r: r.memory.outputs.word(32)),
    "input_bit_registers0_to_31": Field("UINT32", lambda r: r.memory.inputs.word(0)),
    "input_bit_registers32_to_63": Field("UINT32", lambda r: r.memory.inputs.word(32)),
}

TABLES: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("fields.toml").read_text(encoding="utf-8"))
CONSTANT: dict[str, tuple[str, float | tuple[float, ...]]] = {
    name: (type_name, tuple(value) if isinstance(value, list) else value)
    for name, (type_name, value) in TABLES["constant"].items()
}
SETTINGS: dict[str, str] = TABLES["settings"]

REGISTER = re.compile(r"(input|output)_(int|double|bit)_register_(\d+)")


def output_field(name: str) -> Field | None:
    """The variable of that name, None when there is none (the controller then answers NOT_FOUND)."""
    if name in LIVE:
        return LIVE[name]
    if name in CONSTANT:
        field_type, value = CONSTANT[name]
        return Field(field_type, lambda r: value, value)
    match = REGISTER.fullmatch(name)
    return None if match is None else _output_register(match[1] == "input", match[2], int(match[3]))


def _output_register(is_input: bool, kind: str, index: int) -> Field | None:
    def side(readout: Readout) -> Registers:
        return readout.memory.inputs if is_input else readout.memory.outputs

    if kind == "int" and index < N_REGISTERS:
        return Field("INT32", lambda r: side(r).ints[index])
    if kind == "double" and index < N_REGISTERS:
        return Field("DOUBLE", lambda r: side(r).doubles[index])
    if kind == "bit" and 64 <= index < N_BITS:
        return Field("BOOL", lambda r: side(r).bit(index))
    return None


# --- inputs

INPUT_REGISTER = re.compile(r"input_(int|double|bit)_register_(\d+)")


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
    match = INPUT_REGISTER.fullmatch(name)
    return None if match is None else _input_register(match[1], int(match[2]), memory)


def _input_register(kind: str, index: int, memory: Memory) -> InputField | None:
    if kind == "int" and index < N_REGISTERS:
        return InputField("INT32", lambda value: memory.write_int(index, value))
    if kind == "double" and index < N_REGISTERS:
        return InputField("DOUBLE", lambda value: memory.inputs.doubles.__setitem__(index, value))
    if kind == "bit" and 64 <= index < N_BITS:
        return InputField("BOOL", lambda value: memory.inputs.set_bit(index, value))
    return None
