"""What the controller streams on 30001, 30002 (10 Hz) and 30003 (500 Hz), where it also takes programs.

Emulated are the values that RTDE has, too; all others are the constants of simulators/ur/output_fields.py. What is not
imitated: the calibration, configuration, force and additional sub-packages of 30001, and messages of a program.
Source: Universal Robots, "Client Interfaces, primary and secondary" and "real-time client interface", version 5.12.
"""

import struct
from collections.abc import Callable

from simulators.ur.readout import Readout
from simulators.ur.states import RobotMode, RuntimeState, SafetyMode

VERSION_MESSAGE, ROBOT_STATE = 20, 16
CYCLES_PER_STATE = 50  # 10 Hz
REALTIME = struct.Struct(">I152d")  # 1220 bytes
HEAD = struct.Struct(">IB")
MODE = struct.Struct(">IBQ7?BBdddB")
JOINT = struct.Struct(">dddffffB")
CARTESIAN = struct.Struct(">IB12d")
TOOL = struct.Struct(">IBbbddfBffB")
MASTERBOARD = struct.Struct(">IBIIbbddbbddffffBBbIBBB")
ZERO3, ZERO6 = [0.0] * 3, [0.0] * 6
VOLTAGE_V, CURRENT_A = 48.0, 0.6
BUILD_DATE = b"01-03-2022, 00:00:00"


class StateStream:
    """One client's stream. `due` is asked once a cycle."""

    def __init__(self, read: Callable[[], Readout], greeting: bytes, cycles: int, pack: Callable[[Readout], bytes]):
        self._read, self._greeting, self._cycles, self._pack = read, greeting, cycles, pack
        self._last_tick = -1

    def due(self) -> bytes:
        readout = self._read()
        if readout.tick == self._last_tick or readout.tick % self._cycles:
            return b""
        self._last_tick = readout.tick
        greeting, self._greeting = self._greeting, b""
        return greeting + self._pack(readout)


def primary_stream(read: Callable[[], Readout], version: tuple[int, int, int, int]) -> StateStream:
    """Of 30001 and 30002."""
    return StateStream(read, version_message(version), CYCLES_PER_STATE, robot_state)


def realtime_stream(read: Callable[[], Readout], version: tuple[int, int, int, int]) -> StateStream:
    """Of 30003."""
    return StateStream(read, b"", 1, realtime_state)


def version_message(version: tuple[int, int, int, int]) -> bytes:
    """The first thing that a client of 30001 or 30002 gets."""
    name = b"URControl"
    major, minor, bugfix, build = version
    body = struct.pack(">Qbbb", 0, -2, 3, len(name)) + name + struct.pack(">BBii", major, minor, bugfix, build)
    return HEAD.pack(HEAD.size + len(body) + len(BUILD_DATE), VERSION_MESSAGE) + body + BUILD_DATE


def robot_state(r: Readout) -> bytes:
    """Sub-packages 0 mode, 1 joints, 2 tool, 3 masterboard, 4 cartesian."""
    body = _mode(r) + _joints(r) + _tool() + _masterboard(r) + _cartesian(r)
    return HEAD.pack(HEAD.size + len(body), ROBOT_STATE) + body


def realtime_state(r: Readout) -> bytes:
    """All of it as doubles, in the order of the published table."""
    mode, safety = float(r.arm.power.robot_mode), float(r.arm.power.safety_mode)
    installation = r.memory.installation
    return REALTIME.pack(
        REALTIME.size, r.timestamp_s,
        *r.target_q_rad, *r.target_qd_rad_s, *r.target_qdd_rad_s2, *r.current_a, *r.torque_nm,
        *r.q_rad, *r.qd_rad_s, *r.current_a, *r.current_a,
        *r.tool_pose, *r.tool_speed, *ZERO6, *r.target_tool_pose, *r.target_tool_speed,
        0.0, *r.temperature_degC, 0.0, 0.0, mode, *map(float, r.joint_mode), safety,
        *ZERO6, 0.0, 0.0, 9.82, *ZERO6, r.arm.speed_scaling, 0.0, 0.0, 0.0,
        VOLTAGE_V, VOLTAGE_V, CURRENT_A, *(VOLTAGE_V,) * 6, float(r.memory.digital_outputs), float(r.runtime),
        *ZERO3, *ZERO3, safety, *ZERO3,
        installation.payload_kg, *installation.payload_cog_m, *installation.payload_inertia_kg_m2,
    )  # fmt: skip


def _mode(r: Readout) -> bytes:
    power = r.arm.power
    on = power.robot_mode in (RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.RUNNING)
    return MODE.pack(
        MODE.size, 0, round(1e6 * r.timestamp_s), True, True, on,
        power.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP, power.safety_mode is SafetyMode.PROTECTIVE_STOP,
        r.runtime is RuntimeState.PLAYING, r.runtime is RuntimeState.PAUSED,
        power.robot_mode, 0, r.memory.speed_slider, r.arm.speed_scaling, 1.0, 0,
    )  # fmt: skip


def _joints(r: Readout) -> bytes:
    columns = zip(r.q_rad, r.target_q_rad, r.qd_rad_s, r.current_a, r.temperature_degC, r.joint_mode, strict=True)
    each = b"".join(JOINT.pack(q, target, qd, i, VOLTAGE_V, t, t, mode) for q, target, qd, i, t, mode in columns)
    return HEAD.pack(HEAD.size + len(each), 1) + each


def _tool() -> bytes:
    return TOOL.pack(TOOL.size, 2, 0, 0, 0.0, 0.0, VOLTAGE_V, 0, 0.0, 30.0, 253)


def _masterboard(r: Readout) -> bytes:
    safety = r.arm.power.safety_mode
    return MASTERBOARD.pack(
        MASTERBOARD.size, 3, 0, r.memory.digital_outputs, 0, 0, 0.0, 0.0, 0, 0, 0.0, 0.0,
        30.0, VOLTAGE_V, CURRENT_A, 0.02, safety, safety is SafetyMode.REDUCED, 0, 0, 0, 0, 0,
    )  # fmt: skip


def _cartesian(r: Readout) -> bytes:
    return CARTESIAN.pack(CARTESIAN.size, 4, *r.tool_pose, *r.tool_offset)
