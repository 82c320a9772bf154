"""A robot controller behind a Modbus server, TCP or RTU as the rig says, over one arm of the emulated world.

    bench = build(world, rig, "127.0.0.2")

What it does not imitate: anything of the controller but the registers of the rig's map; the time that a PLC takes from
its own cycle to its registers (they are of the last 2 ms); several masters that quarrel about the command registers.
The motion controller is that of the UR emulator, with the rig's joints: its own docstring says what it leaves out.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from simulators.modbus.plc import WRITTEN_BY_CLIENTS, MotionProgram
from simulators.modbus.register_map import Memory, RegisterMap
from simulators.modbus.server import RtuWire, TcpWire
from simulators.ur.dynamics import ArmWorld
from simulators.ur.emulator import arm_controller
from simulators.ur.motion import ArmController
from simulators.ur.readout import TORQUE_PER_CURRENT_NM_A
from simulators.ur.states import SafetyMode
from simulators.wire import Bench, SerialPort, TcpPort, Wire

DEFAULT_PORT = 502


class ModbusController:
    """The controller behind its wires; one `Instrument`."""

    name = "modbus"

    def __init__(self, arm: ArmController, device: Mapping[str, Any], payload_kg: float) -> None:
        self.arm, self.memory = arm, Memory()
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
