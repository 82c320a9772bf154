"""Which instruments of a rig are emulated, and where their clients find them.

A section missing from [devices] is a device that is not emulated.
"""

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from simulators.host.errors import HostError
from simulators.host.loop import Host
from simulators.wire import Bench, SerialPort, TcpPort
from simulators.world.world import World

DEFAULT_BITRATE = 1_000_000


@dataclass(frozen=True)
class EmulatedDevices:
    """One bench for each section of [devices]; None: not emulated."""

    psd: Bench | None
    encoders: Bench | None
    robot: Bench | None

    @property
    def benches(self) -> list[Bench]:
        return [bench for bench in (self.psd, self.encoders, self.robot) if bench is not None]


def build_devices(world: World, rig: Mapping[str, Any], robot_host: str | None) -> EmulatedDevices:
    """The benches of a rig; `robot_host` goes before the one in [devices.robot]. HostError when there is none."""
    wanted: Mapping[str, Any] = rig.get("devices", {})
    robot: Bench | None = None
    if "robot" in wanted:
        host = robot_host or wanted["robot"].get("host")
        if host is None:
            raise HostError('rig file: devices.robot has no host; give one, for example host = "127.0.0.2"')
        robot = _build("ur", world, rig, host)
    return EmulatedDevices(
        psd=_build("psd_daq", world, rig) if "psd" in wanted else None,
        encoders=_build("encoders", world, rig) if "encoders" in wanted else None,
        robot=robot,
    )


def _build(folder: str, *arguments: Any) -> Bench:
    """Loads an emulator only when it is wanted: each brings its own tables."""
    return importlib.import_module(f"simulators.{folder}.emulator").build(*arguments)


def with_robot_on(devices: EmulatedDevices, robot_host: str) -> EmulatedDevices:
    """The same devices with the controller's ports on another address."""
    if devices.robot is None:
        return devices
    ports = [replace(port, host=robot_host) if isinstance(port, TcpPort) else port for port in devices.robot.ports]
    return replace(devices, robot=replace(devices.robot, ports=ports))


def without_links(devices: EmulatedDevices) -> EmulatedDevices:
    """The same devices with serial ports that only the announcement names."""

    def unlinked(bench: Bench | None) -> Bench | None:
        if bench is None:
            return None
        ports = [replace(port, link=None) if isinstance(port, SerialPort) else port for port in bench.ports]
        return replace(bench, ports=ports)

    return EmulatedDevices(unlinked(devices.psd), unlinked(devices.encoders), unlinked(devices.robot))


def addresses(host: Host, devices: EmulatedDevices, rig: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Where each device listens, in the form that `emulate --json` prints."""
    found: dict[str, dict[str, Any]] = {}
    if devices.psd is not None:
        found["psd"] = {"port": host.serial_address(_serial_name(devices.psd))}
    if devices.encoders is not None:
        found["can"] = {
            "interface": "slcan",
            "channel": host.serial_address(_serial_name(devices.encoders)),
            "bitrate": rig["devices"]["encoders"].get("bitrate", DEFAULT_BITRATE),
        }
    if devices.robot is not None:
        found["robot"] = {"host": next(port.host for port in devices.robot.ports if isinstance(port, TcpPort))}
    control_host, control_port = host.tcp_address("control")
    found["control"] = {"host": control_host, "port": control_port}
    return found


def _serial_name(bench: Bench) -> str:
    return next(port.name for port in bench.ports if isinstance(port, SerialPort))
