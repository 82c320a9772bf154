"""What must hold within [devices.robot] of a rig file: a UR controller has an address, a Modbus one a register map."""

from collections.abc import Iterator

from acquisition.recording.rig.devices import RobotDevice, RobotDriver
from acquisition.recording.rig.schema import Rig
from acquisition.recording.rig_lines import KeyPath

PATH: KeyPath = ("devices", "robot")
FASTEST_POLL_HZ = 500.0


def robot_faults(rig: Rig) -> Iterator[tuple[KeyPath, str]]:
    """(key path, what is wrong and what to do), as the rules of rig_rules."""
    robot = rig.devices.robot
    if robot is None:
        return
    yield from _modbus_faults(robot) if robot.driver is RobotDriver.MODBUS else _ur_faults(robot)


def _ur_faults(robot: RobotDevice) -> Iterator[tuple[KeyPath, str]]:
    if robot.host is None:
        yield PATH, "[devices.robot] needs the key 'host', the controller's address"
    for key in ("port", "serial_port", "serial_number", "register"):
        if getattr(robot, "registers" if key == "register" else key) not in (None, ()):
            yield (*PATH, key), f'\'{key}\' belongs to driver "modbus", the driver here is "ur-rtde"; delete it'


def _modbus_faults(robot: RobotDevice) -> Iterator[tuple[KeyPath, str]]:
    if [robot.host, robot.serial_port, robot.serial_number].count(None) != 2:
        yield (
            PATH,
            "[devices.robot] needs either 'host' (Modbus TCP) or 'serial_port' or 'serial_number' (RTU, by path or by "
            "the adapter's USB), and one only",
        )
    if robot.is_rtu and robot.port is not None:
        yield (*PATH, "port"), "'port' is the number of a TCP port; a serial line has none: delete it"
    if not robot.registers:
        yield PATH, "[devices.robot] has no register map: add [[devices.robot.register]], see docs/protocols/modbus.md"
    if robot.rate_hz > FASTEST_POLL_HZ:
        yield (*PATH, "rate_hz"), f"rate_hz = {robot.rate_hz:g}: no controller serves so many polls; try 50"
    names = [register.name for register in robot.registers]
    for index, register in enumerate(robot.registers):
        path = (*PATH, "register", index)
        if register.name in names[:index]:
            yield (*path, "name"), f"register {register.name} stands twice in the map; keep one"
        if register.scale == 0.0:
            yield (
                (*path, "scale"),
                f"register {register.name}: scale 0 loses the value; give what one count is in SI",
            )
