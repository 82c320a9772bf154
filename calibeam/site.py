"""Connects the devices of a rig, whether real or emulated, and runs their readers into the recording."""

import itertools
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from acquisition.psd_view import PsdView
from acquisition.recording.errors import RecordingError, RigFileError
from acquisition.recording.rig_schema import EncodersDevice, PsdDevice, Rig, RobotDevice
from acquisition.recording.stream import Channel, Event
from acquisition.recording.writer import RecordingWriter
from acquisition.streams import Pump
from acquisition.supervisor import Supervisor
from acquisition.wired import Pumps, Speeds, WiredBench, psd_window
from calibeam.identification import check_identifiable
from calibeam.recorded import uninterrupted
from drivers.cia406.device import Cia406Encoders
from drivers.cia406.network import bus_opener
from drivers.clock import Clock
from drivers.device import Block, Device
from drivers.errors import DeviceError, DeviceRefused
from drivers.psd_daq.device import BAUD, PsdDaq
from drivers.transports.serial_port import SerialAddress, open_serial
from drivers.ur.control import UrControl
from drivers.ur.reader import UrReader

UR_JOINTS = 6
SPOTS = ("psd1_x_m", "psd1_y_m", "psd2_x_m", "psd2_y_m")
VIEWED = {
    "psd": ("flags", "temperature_degC"),
    "robot": ("actual_q_rad", "actual_qd_rad_s"),
    "encoders": ("position_rad",),
}


@dataclass(frozen=True)
class Addresses:
    """Where the devices are. `hurry`: device seconds in one second of this program's clock; 1 on site."""

    psd: PsdDevice
    robot: RobotDevice
    encoders: EncodersDevice | None
    hurry: float = 1.0


def check_session(rig: Rig) -> None:
    """What a session needs of a rig beyond what every rig file has. DataError, RigFileError; no device is touched."""
    check_identifiable(rig)
    if rig.motion.home_rad is None:
        raise RigFileError(
            f"rig {rig.name}: [motion] has no home_rad; give joint readings that are clear of everything"
        )
    if rig.n_joints != UR_JOINTS:
        raise RigFileError(f"rig {rig.name}: {rig.n_joints} joints, but driver ur-rtde moves arms of {UR_JOINTS}")


def addresses_of(rig: Rig, emulated: Mapping[str, Any] | None = None, hurry: float = 1.0) -> Addresses:
    """The rig's [devices], or the same devices where emulators announced them. DeviceRefused when one is missing."""
    psd, robot, encoders = rig.devices.psd, rig.devices.robot, rig.devices.encoders
    if psd is None or robot is None:
        missing = "psd" if psd is None else "robot"
        raise DeviceRefused(f"rig {rig.name}: no [devices.{missing}]; a session needs the PSD box and the controller")
    if emulated is None:
        return Addresses(psd, robot, encoders, hurry)
    psd = PsdDevice(psd.driver, port=emulated["psd"]["port"], rate_hz=psd.rate_hz)
    robot = RobotDevice(robot.driver, emulated["robot"]["host"], robot.rate_hz)
    if encoders is not None:
        can = emulated["can"]
        encoders = EncodersDevice(
            encoders.driver, can["interface"], can["channel"], encoders.nodes, can["bitrate"], encoders.sync_hz
        )
    return Addresses(psd, robot, encoders, hurry)


@contextmanager
def connected(
    rig: Rig, addresses: Addresses, writer: RecordingWriter, clock: Clock, place: Callable[[int], None]
) -> Generator[WiredBench]:
    """The bench on wires, its readers running. At the end the arm is stopped and every port released."""
    with ExitStack() as cleaning:
        # The controller's watchdog counts its own seconds: 1 s of silence on this side ends the program.
        control = UrControl(addresses.robot.host, watchdog_hz=1.0 / addresses.hurry, clock=clock)
        supervisor = Supervisor(control.stop)
        psd = _psd(addresses.psd, clock)
        robot = UrReader(addresses.robot.host, addresses.robot.rate_hz, clock=clock)
        pumps = Pumps(
            psd=cleaning.enter_context(_pumped(psd, writer, clock, supervisor, _spots_beside(psd, writer))),
            robot=cleaning.enter_context(_pumped(robot, writer, clock, supervisor)),
            encoders=_encoders(addresses, writer, clock, supervisor, cleaning),
        )
        cleaning.callback(_released, control)
        try:
            control.connect()
        except DeviceError:
            supervisor.check()  # another device failed meanwhile, and its stop ended this too: that is the news
            raise
        speeds = Speeds(rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
        yield WiredBench(control, pumps, _view_of(psd), speeds, supervisor, clock, place, addresses.hurry)


def _released(control: UrControl) -> None:
    with uninterrupted():
        control.close()


def _psd(device: PsdDevice, clock: Clock) -> PsdDaq:
    address = SerialAddress(port=device.port, serial_number=device.serial_number)
    with _refused("devices.psd"):
        return PsdDaq(lambda: open_serial(address, BAUD), rate_hz=device.rate_hz, clock=clock)


def _encoders(
    addresses: Addresses, writer: RecordingWriter, clock: Clock, supervisor: Supervisor, cleaning: ExitStack
) -> Pump | None:
    device = addresses.encoders
    if device is None:
        return None
    open_bus = bus_opener(device.interface, device.channel, device.bitrate)
    with _refused("devices.encoders"):
        encoders = Cia406Encoders(open_bus, device.nodes, device.sync_hz, clock=clock)
    return cleaning.enter_context(_pumped(encoders, writer, clock, supervisor))


@contextmanager
def _refused(section: str) -> Generator[None]:
    """What a driver says of values that it does not take, as an error of the rig's section."""
    try:
        yield
    except ValueError as error:
        raise DeviceRefused(f"[{section}] of the rig file: {error}") from error


def _spots_beside(psd: PsdDaq, writer: RecordingWriter) -> Callable[[Block], None]:
    """Spots of every block as a stream of their own, one sample a block: what a viewer shows without set-up."""
    stream = writer.stream("spots", tuple(Channel(name, "m") for name in SPOTS))
    count = itertools.count()

    def keep(block: Block) -> None:
        spots_m = _view_of(psd).each(psd_window([block])).mean(axis=0)  # a block may hold a single sample: no sigma
        values: dict[str, float] = dict(zip(SPOTS, spots_m.tolist(), strict=True))
        stream.append(block.host_s[-1], block.device_s[-1], next(count), values)

    return keep


def _view_of(psd: PsdDaq) -> PsdView:
    if psd.identity is None:
        raise DeviceRefused(f"{psd.name}: not identified; connect it first")
    return PsdView(psd.identity.faces, psd.identity.transimpedance_v_a)


@contextmanager
def _pumped(
    device: Device,
    writer: RecordingWriter,
    clock: Clock,
    supervisor: Supervisor,
    beside: Callable[[Block], None] = lambda block: None,
) -> Generator[Pump]:
    """The device connected, its blocks going into the recording until left, and to `beside`."""

    def keep(block: Block) -> None:
        stream.append(block.host_s, block.device_s, block.sequence, block.values)
        beside(block)

    def failed(failure: Exception) -> None:
        supervisor.failed(failure)
        with suppress(RecordingError):  # it may be the recording itself that failed
            writer.event(Event(clock.now_s(), "device failed", {"device": device.name, "why": str(failure)}))

    pump = Pump(device, clock, keep, failed)
    try:
        device.connect()
        channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in device.describe())
        stream = writer.stream(device.name, channels, VIEWED.get(device.name))
        pump.start()
        yield pump
    finally:
        with uninterrupted():
            pump.stop()
