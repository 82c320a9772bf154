"""A robot controller behind a Modbus server, TCP or RTU as the rig states, over one arm of the emulated world.

    bench = build(world, rig, "127.0.0.2")

The motion program behind the registers takes a command by its number, and brakes when requested or when left alone. It
is written from docs/protocols/modbus.md; what a site's own program does beyond it is not imitated.

What it does not imitate: anything of the controller but the registers of the rig's map; the time that a PLC takes from
its own cycle to its registers (they are of the last 2 ms); several masters that write the command registers at once.
The motion controller is that of the UR emulator, with the rig's joints: its own docstring states what it leaves out.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from typing import Any

from simulators.modbus.register_map import RegisterMap, RegisterMemory
from simulators.modbus.server import RtuWire, TcpWire
from simulators.ur.dynamics import ArmWorld
from simulators.ur.emulator import arm_controller
from simulators.ur.motion import ArmController, MoveRefused
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A
from simulators.ur.states import SafetyMode
from simulators.wire import Bench, SerialPort, TcpPort, Wire

WRITTEN_BY_CLIENTS = (
    "command_q_rad",
    "command_speed_rad_s",
    "command_acceleration_rad_s2",
    "command_number",
    "stop",
    "host_life",
)
SILENCE_LIMIT_S = 1.0  # a moving arm brakes when host_life stood still for so long
DECELERATION_RAD_S2 = 6.0  # feels right for an arm of this size


class State(IntEnum):
    """Of the command with the number beside it."""

    NONE = 0
    MOVING = 1
    ARRIVED = 2
    REFUSED = 3
    STOPPED = 4


class Reason(IntEnum):
    """Why it was refused or stopped."""

    NONE = 0
    STOP = 1
    HOST_SILENT = 2
    OUT_OF_RANGE = 3
    PROTECTIVE_STOP = 4
    EMERGENCY_STOP = 5
    NOT_READY = 6


class MotionProgram:
    """One step each cycle. `running` False: the PLC has stopped, its registers stay as they are."""

    def __init__(self, arm: ArmController, registers: RegisterMap) -> None:
        self._arm, self._registers = arm, registers
        self.running = True
        self.state, self.reason, self.number = State.NONE, Reason.NONE, 0
        self._life = 0
        self._host_life, self._host_life_s = 0.0, 0.0
        self._stopping = Reason.NONE

    @property
    def can_move(self) -> bool:
        """The rig's map has the registers of the handshake."""
        return all(name in self._registers.entries for name in WRITTEN_BY_CLIENTS)

    def before_step(self, t_s: float) -> None:
        if not self.running:
            return
        self._life = (self._life + 1) & 0xFFFF
        if self.can_move:
            self._hear(t_s)
            self._guard(t_s)
            self._take()
        self._arm.before_step(t_s)

    def publish(self, readings: dict[str, Sequence[float]]) -> None:
        """The cycle's results into the registers."""
        if not self.running:
            return
        for name, values in readings.items():
            self._registers.put(name, values)
        for name, value in (
            ("life", self._life),
            ("state", self.state),
            ("state_number", self.number),
            ("reason", self.reason),
        ):
            self._registers.put(name, [value])

    def _hear(self, t_s: float) -> None:
        (life,) = self._registers.get("host_life")
        if life != self._host_life or self.state is not State.MOVING:
            self._host_life, self._host_life_s = life, t_s

    def _guard(self, t_s: float) -> None:
        """Watches a running move: its end, and every reason to end it early."""
        if self.state is not State.MOVING:
            return
        reason = self._reason_to_stop(t_s)
        if reason is not Reason.NONE and self._stopping is Reason.NONE:
            self._stopping = reason
            self._arm.stop(DECELERATION_RAD_S2)
        if not self._arm.moving:
            self.state = State.ARRIVED if self._stopping is Reason.NONE else State.STOPPED
            self.reason = self._stopping

    def _reason_to_stop(self, t_s: float) -> Reason:
        if self._registers.get("stop")[0] != 0.0:
            return Reason.STOP
        if t_s - self._host_life_s > SILENCE_LIMIT_S:
            return Reason.HOST_SILENT
        return self._safety()

    def _safety(self) -> Reason:
        power = self._arm.power
        if power.safety_mode is SafetyMode.PROTECTIVE_STOP:
            return Reason.PROTECTIVE_STOP
        if power.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            return Reason.EMERGENCY_STOP
        return Reason.NONE if power.ready else Reason.NOT_READY

    def _take(self) -> None:
        """A new number is a new command; while the arm moves it waits."""
        number = int(self._registers.get("command_number")[0])
        if number == self.number or self.state is State.MOVING:
            return
        self.number, self._stopping = number, Reason.NONE
        self.reason = Reason.STOP if self._registers.get("stop")[0] != 0.0 else self._safety()
        if self.reason is Reason.NONE:
            self.reason = self._begin()
        self.state = State.MOVING if self.reason is Reason.NONE else State.REFUSED

    def _begin(self) -> Reason:
        q_rad = self._registers.get("command_q_rad")
        (speed,) = self._registers.get("command_speed_rad_s")
        (acceleration,) = self._registers.get("command_acceleration_rad_s2")
        if not all(map(math.isfinite, (*q_rad, speed, acceleration))):
            return Reason.OUT_OF_RANGE
        try:
            self._arm.move_joints(q_rad, speed, acceleration)
        except MoveRefused:
            return Reason.OUT_OF_RANGE
        return Reason.NONE


DEFAULT_PORT = 502


class ModbusController:
    """The controller behind its wires; one `Instrument`."""

    name = "modbus"

    def __init__(self, arm: ArmController, device: Mapping[str, Any], payload_kg: float) -> None:
        self.arm, self.memory = arm, RegisterMemory()
        self.registers = RegisterMap(device, self.memory, WRITTEN_BY_CLIENTS)
        self.program = MotionProgram(arm, self.registers)
        self.silent = False
        self._payload_kg = payload_kg
        self._wires: list[TcpWire] = []

    def before_step(self, t_s: float) -> None:
        self.program.before_step(t_s)

    def after_step(self, t_s: float) -> None:
        self.program.publish(self._readings())

    def accept(self) -> Wire:
        wire = TcpWire(self.memory, lambda: self.silent)
        self._wires.append(wire)
        return wire

    def closed(self, wire: Wire) -> None:
        self._wires = [other for other in self._wires if other is not wire]

    def disconnect(self) -> None:
        """Drops every TCP client; they may come back."""
        for wire in self._wires:
            wire.closing = True

    def _readings(self) -> dict[str, Sequence[float]]:
        joints, power = self.arm.joints, self.arm.power
        currents = [
            torque / ratio for torque, ratio in zip(joints.torque_nm.tolist(), TORQUE_PER_CURRENT_NM_A, strict=False)
        ]
        return {
            "actual_q_rad": joints.q_rad.tolist(),
            "actual_qd_rad_s": joints.qd_rad_s.tolist(),
            "target_q_rad": self.arm.setpoint.q_rad.tolist(),
            "actual_current_a": currents,
            "joint_temperature_degC": joints.temperature_degC.tolist(),
            "robot_mode": [power.robot_mode],
            "safety_mode": [power.safety_mode],
            "protective_stopped": [power.safety_mode is SafetyMode.PROTECTIVE_STOP],
            "emergency_stopped": [power.safety_mode is SafetyMode.ROBOT_EMERGENCY_STOP],
            "speed_scaling": [self.arm.speed_scaling],
            "payload_kg": [self._payload_kg],
        }


def build(world: ArmWorld, rig: Mapping[str, Any], host: str | None, *, unlock_delay_s: float = 0.0) -> Bench:
    """Modbus TCP on `host`, or RTU when the rig names a serial line. ValueError when the rig's arm is none to drive."""
    device = rig["devices"]["robot"]
    payload_kg = float(rig.get("tool", {}).get("mass_kg", 0.0))
    controller = ModbusController(arm_controller(world, rig, unlock_delay_s=unlock_delay_s), device, payload_kg)
    if "serial_port" in device or "serial_number" in device:
        wire = RtuWire(controller.memory, int(device.get("unit", 1)), lambda: controller.silent)
        port = SerialPort("modbus", wire, device.get("serial_port"))
    else:
        number = int(device.get("port", DEFAULT_PORT))
        port = TcpPort("modbus", str(host), number, controller.accept, controller.closed)
    return Bench([controller], [port], _verbs(controller))


def _verbs(controller: ModbusController) -> dict[str, Callable[..., Any]]:
    """What a person at the cell, or a fault, would do."""
    arm, program = controller.arm, controller.program

    def protective_stop() -> None:
        arm.protective_stop("side channel")

    def emergency_stop(on: bool = True) -> None:
        """Released, the motors come on again by themselves, half an emulated second for each mode on the way."""
        arm.emergency_stop(on)
        if not on:
            arm.power.brake_release()

    def silence(on: bool = True) -> None:
        controller.silent = on

    def program_running(on: bool) -> None:
        program.running = on

    def state() -> dict[str, str]:
        return {
            "robot_mode": arm.power.robot_mode.name,
            "safety_mode": arm.power.safety_mode.name,
            "state": program.state.name,
            "reason": program.reason.name,
        }

    return {
        "robot.protective_stop": protective_stop,
        "robot.unlock": arm.unlock,
        "robot.emergency_stop": emergency_stop,
        "robot.silence": silence,
        "robot.disconnect": controller.disconnect,
        "robot.program": program_running,
        "robot.state": state,
        "robot.standing": lambda: not arm.moving,
    }
