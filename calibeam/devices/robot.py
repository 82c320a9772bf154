"""The drivers of a rig's controller: one that records it, and one that moves it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec

from acquisition.recording import RigFileError
from acquisition.recording.rig.devices import RobotDevice, RobotDriver
from drivers.clock import Clock
from drivers.device import Device, Movable
from drivers.errors import DeviceRefused
from drivers.modbus.arm import LIFE_S, ModbusArm
from drivers.modbus.line import ModbusLine, RtuAddress, TcpAddress
from drivers.modbus.reader import ModbusReader
from drivers.modbus.register_map import Register, RegisterMap
from drivers.ur.control import WATCHDOG_HZ, UrControl
from drivers.ur.reader import UrReader

MODBUS_PORT = 502  # registered for Modbus TCP


@dataclass(frozen=True)
class Robot:
    """A controller that can be read. `arm` is made when it shall move, for not every register map can."""

    reader: Device
    arm: Callable[[], Movable]


def robot_of(device: RobotDevice, clock: Clock, hurry: float = 1.0) -> Robot:
    """The drivers of [devices.robot]; nothing is opened. `hurry`: device seconds in one of this program's clock."""
    return _MAKERS[device.driver](device, clock, hurry)


def emulated_robot(device: RobotDevice, where: Mapping[str, Any]) -> RobotDevice:
    """The same controller where emulators announced it: "host" and "port", or "serial_port"."""
    found = {"host": None, "port": None, "serial_port": None, "serial_number": None, **where}
    return msgspec.structs.replace(device, **found)


def _ur(device: RobotDevice, clock: Clock, hurry: float) -> Robot:
    host = _given(device.host, "host")
    # The controller's watchdog counts its own seconds, not those of this side.
    return Robot(
        UrReader(host, device.rate_hz, clock=clock),
        lambda: UrControl(host, watchdog_hz=WATCHDOG_HZ / hurry, clock=clock),
    )


def _modbus(device: RobotDevice, clock: Clock, hurry: float) -> Robot:
    if device.is_rtu:
        address = RtuAddress(device.serial_port, device.baud, device.parity, device.stop_bits, device.serial_number)
    else:
        address = TcpAddress(_given(device.host, "host"), MODBUS_PORT if device.port is None else device.port)
    try:
        registers = RegisterMap(
            (
                Register(r.name, r.address, r.type.value, r.count, r.scale, r.word_order, r.table, r.turns_address)
                for r in device.registers
            ),
            device.read_across,
        )
    except ValueError as error:
        raise DeviceRefused(f"[devices.robot] of the rig file: {error}") from error
    line = ModbusLine(address, device.unit)
    # An RTU line has one master: reader and arm share it. Over TCP a stop must not wait behind a poll.
    arm_line = line if device.is_rtu else ModbusLine(address, device.unit)
    reader = ModbusReader(line, registers, device.rate_hz, clock=clock)
    return Robot(reader, lambda: _arm(arm_line, registers, clock, hurry))


def _arm(line: ModbusLine, registers: RegisterMap, clock: Clock, hurry: float) -> Movable:
    try:
        return ModbusArm(line, registers, life_s=LIFE_S / hurry, clock=clock)
    except ValueError as error:
        raise DeviceRefused(f"[devices.robot] of the rig file: {error}") from error


def _given(value: str | None, key: str) -> str:
    if value is None:
        raise RigFileError(f"[devices.robot] has no {key}")
    return value


_MAKERS: Mapping[RobotDriver, Callable[[RobotDevice, Clock, float], Robot]] = {
    RobotDriver.UR_RTDE: _ur,
    RobotDriver.MODBUS: _modbus,
}
