"""The ports 30001, 30002 (10 Hz) and 30003 (500 Hz): the controller streams its state, and takes URScript text.

Emulated are the values that RTDE has, too; all others are the constants of simulators/ur/fields.py. Every robot state
holds all its sub-packages. 30001 also reports programs that were refused or ended in an error. What is not imitated:
the safety sub-package (10, for the manufacturer's own use), key, label, pop-up and text messages.

Source: Universal Robots, "Client Interfaces, primary and secondary" and "real-time client interface", versions 5.10 to
5.23, which agree in what is sent here.
"""

import struct
from collections.abc import Callable

from simulators.ur.motion import ACCELERATION_LIMIT_RAD_S2, SPEED_LIMIT_RAD_S
from simulators.ur.program import ProgramRunner
from simulators.ur.readout import Readout
from simulators.ur.states import JointMode, RobotMode, RuntimeState, SafetyMode

MAX_TEXT_BYTES = 1 << 20  # a control script has 42 kB; what grows beyond this is no script


class ScriptWire:
    """One client's connection. A program is complete with a line `end` at column 0, a bare call with its line."""

    def __init__(self, run: Callable[[str], None], stream: Callable[[], bytes] = bytes) -> None:
        """`run` gets each complete program or line; it never raises. `stream`: what is to be sent this cycle."""
        self._run, self._stream = run, stream
        self.closing = False
        self._line = bytearray()
        self._program: list[str] = []
        self._size = 0

    def handle(self, data: bytes) -> bytes:
        *lines, rest = (bytes(self._line) + data).split(b"\n")
        self._line = bytearray(rest)
        self._size += len(data)
        for line in lines:
            self._take(line.decode("utf-8", errors="replace").rstrip("\r"))
        if self._size > MAX_TEXT_BYTES:
            self._forget()
        return b""

    def due(self) -> bytes:
        return self._stream()

    def _take(self, line: str) -> None:
        if self._program:
            self._program.append(line)
            if line == "end":
                self._run("\n".join(self._program))
                self._forget()
        elif line.startswith("def "):
            self._program = [line]
        elif line.strip():
            self._run(line.strip())
            self._size = len(self._line)

    def _forget(self) -> None:
        self._program.clear()
        if self._size > MAX_TEXT_BYTES:
            self._line.clear()
        self._size = len(self._line)


ROBOT_MESSAGE, ROBOT_STATE = 20, 16
VERSION_MESSAGE, RUNTIME_EXCEPTION = 3, 10
ERROR_SOURCE = -2  # as in the version message
CYCLES_PER_STATE = 50  # 10 Hz
REALTIME = struct.Struct(">I152d")  # 1220 bytes
HEAD = struct.Struct(">IB")
MODE = struct.Struct(">IBQ7?BBdddB")
JOINT = struct.Struct(">dddffffB")
CARTESIAN = struct.Struct(">IB12d")
TOOL = struct.Struct(">IBbbddfBffB")
MASTERBOARD = struct.Struct(">IBIIbbddbbddffffBBbIBBB")
KINEMATICS = struct.Struct(">IB6I24dI")  # checksums, theta, a, d, alpha, status of the calibration
CONFIGURATION = struct.Struct(">IB12d12d5d24d4I")  # limits, defaults, a, d, alpha, theta, versions and types
FORCE_MODE = struct.Struct(">IB7d")
ADDITIONAL = struct.Struct(">IB4B")
CALIBRATION = struct.Struct(">IB6d")  # for the manufacturer's own use: the wrench
TOOL_COMMUNICATION = struct.Struct(">IB?3i2f")
TOOL_MODE = struct.Struct(">IB3B")
NOT_CALIBRATED = 0  # the kinematics are those of the drawing
# 1: a UR5 (Universal_Robots_Client_Library); the other two are assumed, not verified
CONTROLLER_BOX, UR5_TYPE, UR5_SUBTYPE = 1, 1, 1
JOINT_DEFAULTS, TOOL_DEFAULTS = (1.05, 1.4), (0.25, 1.2)  # URScript, movej and movel
ZERO3, ZERO6 = [0.0] * 3, [0.0] * 6
VOLTAGE_V, CURRENT_A = 48.0, 0.6
TOOL_DEGC, BOARD_DEGC = 30.0, 30.0
BUILD_DATE = b"01-03-2022, 00:00:00"


class StateStream:
    """One client's stream. `due` is asked once a cycle."""

    def __init__(
        self, read: Callable[[], Readout], greeting: bytes, cycles: int, pack: Callable[[Readout], bytes],
        runner: ProgramRunner | None = None,
    ):  # fmt: skip
        """`runner`: whose failures from now on are sent, too, before the next package."""
        self._read, self._greeting, self._cycles, self._pack = read, greeting, cycles, pack
        self._runner, self._n_reported = runner, 0 if runner is None else runner.n_failures
        self._last_tick = -1

    def due(self) -> bytes:
        readout = self._read()
        if readout.tick == self._last_tick or readout.tick % self._cycles:
            return b""
        self._last_tick = readout.tick
        greeting, self._greeting = self._greeting, b""
        return greeting + self._errors(readout.timestamp_s) + self._pack(readout)

    def _errors(self, time_s: float) -> bytes:
        if self._runner is None:
            return b""
        new = self._runner.failures_since(self._n_reported)
        self._n_reported = self._runner.n_failures
        return b"".join(runtime_exception(time_s, text) for text in new)


def primary_stream(
    read: Callable[[], Readout], version: tuple[int, int, int, int], runner: ProgramRunner | None = None
) -> StateStream:
    """Of 30001 (with the failures of programs) and 30002."""
    return StateStream(read, version_message(version), CYCLES_PER_STATE, robot_state, runner)


def realtime_stream(read: Callable[[], Readout]) -> StateStream:
    """Of 30003."""
    return StateStream(read, b"", 1, realtime_state)


def version_message(version: tuple[int, int, int, int]) -> bytes:
    """The first thing that a client of 30001 or 30002 gets."""
    name = b"URControl"
    major, minor, bugfix, build = version
    body = struct.pack(">Qbbb", 0, -2, VERSION_MESSAGE, len(name)) + name
    body += struct.pack(">BBii", major, minor, bugfix, build) + BUILD_DATE
    return HEAD.pack(HEAD.size + len(body), ROBOT_MESSAGE) + body


def runtime_exception(time_s: float, text: str) -> bytes:
    """A program was refused or has ended in an error; line and column are not known to this controller."""
    body = struct.pack(">Qbbii", round(1e6 * time_s), ERROR_SOURCE, RUNTIME_EXCEPTION, 0, 0) + text.encode()[:1024]
    return HEAD.pack(HEAD.size + len(body), ROBOT_MESSAGE) + body


def robot_state(r: Readout) -> bytes:
    """Sub-packages 0 mode, 1 joints, 2 tool, 3 masterboard, 4 cartesian, 5 kinematics, 6 configuration, 7 force mode,
    8 additional, 9 calibration, 11 tool communication, 12 tool mode.
    """
    body = _mode(r) + _joints(r) + _tool(r) + _masterboard(r) + _cartesian(r) + _kinematics(r) + _configuration(r)
    body += FORCE_MODE.pack(FORCE_MODE.size, 7, *r.tool_wrench, 0.0)
    body += ADDITIONAL.pack(ADDITIONAL.size, 8, 0, 0, 0, 0)  # no teach button, no free-drive
    body += CALIBRATION.pack(CALIBRATION.size, 9, *r.raw_wrench)
    body += TOOL_COMMUNICATION.pack(TOOL_COMMUNICATION.size, 11, False, 115200, 0, 1, 1.5, 3.5)
    body += TOOL_MODE.pack(TOOL_MODE.size, 12, 0, 0, 0)
    return HEAD.pack(HEAD.size + len(body), ROBOT_STATE) + body


def realtime_state(r: Readout) -> bytes:
    """All of it as doubles, in the order of the published table."""
    mode, safety = float(r.arm.power.robot_mode), float(r.arm.power.safety_mode)
    installation = r.memory.installation
    return REALTIME.pack(
        REALTIME.size, r.timestamp_s,
        *r.target_q_rad, *r.target_qd_rad_s, *r.target_qdd_rad_s2, *r.current_a, *r.torque_nm,
        *r.q_rad, *r.qd_rad_s, *r.current_a, *r.current_a,
        *r.tool_pose, *r.tool_speed, *r.tool_wrench, *r.target_tool_pose, *r.target_tool_speed,
        0.0, *r.temperature_degC, 0.2, 0.0, mode, *map(float, r.joint_mode), safety,
        *ZERO6, *r.accelerometer_m_s2, *ZERO6, r.arm.speed_scaling, 0.0, 0.0, 0.0,
        VOLTAGE_V, VOLTAGE_V, CURRENT_A, *(VOLTAGE_V,) * 6, float(r.memory.digital_outputs), float(r.runtime),
        *r.elbow_m, *r.elbow_speed_m_s, safety, *ZERO3,
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


def _tool(r: Readout) -> bytes:
    voltage_v = r.memory.tool_voltage_v
    return TOOL.pack(TOOL.size, 2, 0, 0, 0.0, 0.0, VOLTAGE_V, voltage_v, 0.0, TOOL_DEGC, JointMode.RUNNING)


def _masterboard(r: Readout) -> bytes:
    safety, types = r.arm.power.safety_mode, r.memory.analog_types
    return MASTERBOARD.pack(
        MASTERBOARD.size, 3, 0, r.memory.digital_outputs, types & 1, types >> 1 & 1, 0.0, 0.0,
        types >> 2 & 1, types >> 3 & 1, *r.memory.analog_outputs,
        BOARD_DEGC, VOLTAGE_V, CURRENT_A, 0.02, safety, safety is SafetyMode.REDUCED, 0, 0, 0, 0, 0,
    )  # fmt: skip


def _kinematics(r: Readout) -> bytes:
    arm = r.arm.arm
    return KINEMATICS.pack(
        KINEMATICS.size, 5, *(0,) * 6, *arm.theta_offset_rad, *arm.a_m, *arm.d_m, *arm.alpha_rad, NOT_CALIBRATED
    )


def _configuration(r: Readout) -> bytes:
    arm = r.arm.arm
    limits = (limit for pair in r.arm.limits_rad for limit in pair)
    rates = (SPEED_LIMIT_RAD_S, ACCELERATION_LIMIT_RAD_S2) * 6
    return CONFIGURATION.pack(
        CONFIGURATION.size, 6, *limits, *rates, *JOINT_DEFAULTS, *TOOL_DEFAULTS, 0.0,
        *arm.a_m, *arm.d_m, *arm.alpha_rad, *arm.theta_offset_rad, 0, CONTROLLER_BOX, UR5_TYPE, UR5_SUBTYPE,
    )  # fmt: skip


def _cartesian(r: Readout) -> bytes:
    return CARTESIAN.pack(CARTESIAN.size, 4, *r.tool_pose, *r.tool_offset)
