"""Which instruments of a rig are emulated, and where their clients find them.

A section missing from [devices] is a device that is not emulated.
"""

import importlib
import ipaddress
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import entry_points
from typing import Any

from simulators.encoders.shaft import ShaftWorld
from simulators.errors import HostError
from simulators.faults.device_faults import DisturbedLight
from simulators.faults.injector import Injector, with_faults
from simulators.hand.world import HandWorld
from simulators.host.loop import Host
from simulators.wire import Bench, SerialPort, TcpPort, UdpPort
from simulators.world.world import World

DEFAULT_BITRATE = 1_000_000
PLUG_INS = "calibeam.devices"  # group of entry points
UR = "ur-rtde"
PSD_DAQ = "psd-daq"
PSDS = {PSD_DAQ: "psd_daq", "kpa101": "kpa101"}
ROBOTS = {UR: "ur", "modbus": "modbus"}  # the rig's driver -> the emulator that it talks to


@dataclass(frozen=True)
class EmulatedDevices:
    """One bench for each section of [devices]; None: not emulated."""

    psd: Bench | None
    encoders: Bench | None
    robot: Bench | None
    camera: Bench | None = None
    tracker: Bench | None = None
    others: Mapping[str, Bench] = field(default_factory=dict[str, Bench])  # of plug-ins, by name
    injectors: Mapping[str, Injector] = field(default_factory=dict[str, Injector])  # by the announcement's names

    @property
    def benches(self) -> list[Bench]:
        every = (self.psd, self.encoders, self.robot, self.camera, self.tracker, *self.others.values())
        return [bench for bench in every if bench is not None]


def build_devices(
    world: World | HandWorld | ShaftWorld, rig: Mapping[str, Any], robot_host: str | None
) -> EmulatedDevices:
    """The benches of a rig; `robot_host` goes before the one in [devices.robot]. HostError when there is none."""
    wanted: Mapping[str, Any] = rig.get("devices", {})
    light = None if isinstance(world, HandWorld | ShaftWorld) else DisturbedLight(world)
    psd = _build(PSDS[wanted["psd"].get("driver", PSD_DAQ)], light, rig) if "psd" in wanted else None
    encoders = _build("encoders", world, rig) if "encoders" in wanted else None
    robot = _robot(world, rig, wanted["robot"], robot_host) if "robot" in wanted else None
    tracker = _build("tracker", world, rig) if "tracker" in wanted else None
    faulty = {
        name: with_faults(name, bench, light if bench is psd else None)
        for name, bench in (("psd", psd), ("can", encoders), ("robot", robot), ("tracker", tracker))
        if bench is not None
    }
    others = [str(other["name"]) for other in wanted.get("other", ())]
    faulty |= {
        other["name"]: with_faults(other["name"], bench)
        for other in wanted.get("other", ())
        if (bench := plug_in_bench(world, other)) is not None
    }
    benches = {name: bench for name, (bench, _) in faulty.items()}
    injectors = {name: injector for name, (_, injector) in faulty.items()}
    camera = _build("camera", world, rig, world.truth.seed) if "camera" in rig else None
    return EmulatedDevices(
        benches.get("psd"),
        benches.get("can"),
        benches.get("robot"),
        camera,
        benches.get("tracker"),
        {name: benches[name] for name in others if name in benches},
        injectors,
    )


def _robot(
    world: World | HandWorld | ShaftWorld, rig: Mapping[str, Any], device: Mapping[str, Any], robot_host: str | None
) -> Bench:
    host = robot_host or device.get("host")
    if host is None and not {"serial_port", "serial_number"} & device.keys():
        raise HostError('rig file: devices.robot has no host; give one, for example host = "127.0.0.2"')
    return _build(ROBOTS[device.get("driver", UR)], world, rig, host)


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
    """The same devices with ports that only the announcement names."""

    def unlinked(bench: Bench | None) -> Bench | None:
        if bench is None:
            return None
        ports = [replace(port, link=None) if isinstance(port, SerialPort) else port for port in bench.ports]
        return replace(bench, ports=ports)

    camera = _anywhere(devices.camera)
    return replace(
        devices,
        psd=unlinked(devices.psd),
        encoders=unlinked(devices.encoders),
        robot=unlinked(devices.robot),
        camera=camera,
        tracker=_anywhere(unlinked(devices.tracker)),
        others={name: _at_announced_ports(bench) for name, bench in devices.others.items()},
    )


def _at_announced_ports(bench: Bench) -> Bench:
    """On ports that only the announcement names."""
    ports = [
        replace(port, link=None)
        if isinstance(port, SerialPort)
        else replace(port, port=0)
        if isinstance(port, TcpPort)
        else port
        for port in bench.ports
    ]
    return replace(bench, ports=ports)


def _anywhere(bench: Bench | None) -> Bench | None:
    """Listening where the system has room."""
    if bench is None:
        return None
    ports = [replace(port, port=0) if isinstance(port, TcpPort) else port for port in bench.ports]
    return replace(bench, ports=ports)


def check_private(devices: EmulatedDevices) -> None:
    """HostError when a device would listen where other machines reach it: their protocols know no password."""
    for bench in devices.benches:
        for port in bench.ports:
            if isinstance(port, TcpPort | UdpPort) and not is_loopback(port.host):
                raise HostError(
                    f"{port.name}: {port.host} can be reached from the network, and {port.name} knows no password; "
                    "emulate on one of 127.0.0.x, or ask for it with --expose"
                )


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches that address. A name that is no address counts as public."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def addresses(host: Host, devices: EmulatedDevices, rig: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Where each device listens, in the form that `emulate --json` prints."""
    found: dict[str, dict[str, Any]] = {}
    if devices.psd is not None:
        ports = [host.serial_address(port.name) for port in devices.psd.ports if isinstance(port, SerialPort)]
        found["psd"] = {"port": ports[0]} if len(ports) == 1 else {"ports": ports}
    if devices.encoders is not None:
        found["can"] = {
            "interface": "slcan",
            "channel": host.serial_address(_serial_name(devices.encoders)),
            "bitrate": rig["devices"]["encoders"].get("bitrate", DEFAULT_BITRATE),
        }
    if devices.robot is not None:
        found["robot"] = _robot_address(host, devices.robot, rig["devices"]["robot"].get("driver", UR))
    if devices.camera is not None:
        found["camera"] = {"source": _source(*host.tcp_address(devices.camera.ports[0].name))}
    if devices.tracker is not None:
        found["tracker"] = _first_address(host, devices.tracker.ports[0])
    for name, bench in devices.others.items():
        found[name] = _first_address(host, bench.ports[0])
    control_host, control_port = host.tcp_address("control")
    found["control"] = {"host": control_host, "port": control_port}
    return found


def _robot_address(host: Host, robot: Bench, driver: str) -> dict[str, Any]:
    """A UR controller has the ports of its make; a Modbus server states which."""
    sockets = [port for port in robot.ports if isinstance(port, TcpPort)]
    if not sockets:
        return {"serial_port": host.serial_address(_serial_name(robot))}
    if driver != "modbus":
        return {"host": sockets[0].host}
    address, number = host.tcp_address(sockets[0].name)
    return {"host": address, "port": number}


def _first_address(host: Host, port: SerialPort | TcpPort | UdpPort) -> dict[str, Any]:
    if isinstance(port, SerialPort):
        return {"serial_port": host.serial_address(port.name)}
    address, number = (port.host, port.port) if isinstance(port, UdpPort) else host.tcp_address(port.name)
    return {"host": address, "port": number}


def _source(host: str, port: int) -> str:
    """What opens the emulated camera; its module is loaded only where there is one."""
    return importlib.import_module("simulators.camera.emulator").url(host, port)


def _serial_name(bench: Bench) -> str:
    return next(port.name for port in bench.ports if isinstance(port, SerialPort))


def plug_in_bench(world: Any, other: Mapping[str, Any]) -> Bench | None:
    """The bench of one [[devices.other]]; None, reported on standard error, where its package emulates nothing.

    The entry point of an installed package is an object with `emulator`, "module:function" or an empty text; the
    function is called with the world and the settings of the rig file. HostError naming the package where that fails,
    and where no package has this driver.
    """
    driver = str(other.get("driver"))
    found = next(iter(entry_points(group=PLUG_INS, name=driver)), None)
    if found is None:
        raise HostError(f"{other.get('name')}: no installed package brings the driver '{driver}'; install it")
    package = "?" if found.dist is None else f"{found.dist.name} {found.dist.version}"
    try:
        where = str(found.load().emulator)
        if not where:
            print(f"{other.get('name')}: the package {package} brings no emulator; left out", file=sys.stderr)
            return None
        module, _, function = where.partition(":")
        bench = getattr(importlib.import_module(module), function)(world, dict(other.get("settings", {})))
    except Exception as why:  # whatever a stranger's module raises
        raise HostError(
            f"{other.get('name')}: the emulator of the package {package} cannot be made: {type(why).__name__}: {why}"
        ) from why
    if not isinstance(bench, Bench) or not bench.ports:
        raise HostError(f"{other.get('name')}: the package {package} gives no bench with a port")
    return bench
