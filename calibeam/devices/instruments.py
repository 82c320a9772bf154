"""The instruments that a rig file names (detectors, tracker, camera), for a session, a check, the live page and a log.

OpenCV is loaded only where there is a camera.
"""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from msgspec import structs

from acquisition.recording import RigFileError
from acquisition.recording.rig import Camera, Rig
from acquisition.recording.rig.devices import PsdDevice, PsdDriver, TrackerDevice, TrackerDriver
from acquisition.wires.psd_view import PsdView
from drivers.clock import Clock
from drivers.device import Device
from drivers.errors import DeviceRefused
from drivers.psd_daq.device import BAUD as DAQ_BAUD
from drivers.psd_daq.device import PsdDaq
from drivers.psd_daq.messages import Identity
from drivers.psd_error_map import ErrorMap
from drivers.psd_faces import Face, FaceKind
from drivers.psd_kpa101.pair import BAUD as KPA101_BAUD
from drivers.psd_kpa101.pair import Head, Kpa101Pair, Wiring
from drivers.tracker.codec import LENGTH_UNITS, TIME_UNITS, Parse, Units, ascii_lines, json_lines
from drivers.tracker.device import Dialogue, LineTracker
from drivers.transports.serial_port import SerialAddress, open_serial
from drivers.transports.transport import TcpLine, Transport, UdpReceiver

if TYPE_CHECKING:
    from acquisition.centring.camera.board import Sight
    from drivers.camera.device import Camera as CameraDevice

HEADS = {"pin-cushion": FaceKind.PIN_CUSHION, "quadrant": FaceKind.QUADRANT}


class PsdInstrument(Device, Protocol):
    """A device that knows its two faces once connected."""

    @property
    def identity(self) -> Identity | None: ...


def psd_driver(device: PsdDevice, rig: Rig, clock: Clock, hurry: float = 1.0) -> PsdInstrument:
    """Not connected yet. DeviceRefused for values and error maps that nobody can take. `hurry`: see Kpa101Pair."""
    _error_maps(device)  # what is wrong with a file is reported before a device is touched
    try:
        if device.driver is PsdDriver.KPA101:
            return _pair(device, rig, clock, hurry)
        address = SerialAddress(port=device.port, serial_number=device.serial_number)
        return PsdDaq(lambda: open_serial(address, DAQ_BAUD), rate_hz=device.rate_hz, clock=clock)
    except ValueError as error:
        raise DeviceRefused(f"[devices.psd] of the rig file: {error}") from error


def emulated_psd(device: PsdDevice, announced: Mapping[str, Any]) -> PsdDevice:
    """The same detectors where emulators announced them."""
    ports = tuple(announced["ports"]) if "ports" in announced else None
    return structs.replace(device, port=announced.get("port"), ports=ports, serial_number=None, serial_numbers=None)


def psd_view(psd: PsdInstrument, device: PsdDevice) -> PsdView:
    """How to read a connected instrument, error maps included. DeviceRefused for a map or a face that cannot be."""
    identity = psd.identity
    if identity is None:
        raise DeviceRefused(f"{psd.name}: not identified; connect it first")
    try:
        one, other = (Face(face.kind, face.length_m, device.spot_radius_m) for face in identity.faces)
    except ValueError as error:
        raise DeviceRefused(f"[devices.psd] of the rig file: {error}") from error
    return PsdView((one, other), identity.transimpedance_v_a, _error_maps(device))


def _pair(device: PsdDevice, rig: Rig, clock: Clock, hurry: float) -> Kpa101Pair:
    fixture = rig.fixture
    if device.length_m is None and fixture is None:
        raise ValueError(
            "length_m is missing, and there is no [fixture] with half_size_m to take it from; add one of them"
        )
    length_m = device.length_m or (2.0 * fixture.half_size_m if fixture is not None else 0.0)

    def head(place: int) -> Head:
        wiring = Wiring(
            device.x_signs[place], device.y_signs[place], device.sum_full_scale_v[place], device.transimpedance_v_a
        )
        number = device.serial_numbers[place] if device.serial_numbers is not None else None
        return Head(HEADS[device.head.value], length_m, wiring, number)

    def line(place: int) -> Callable[[], Transport]:
        if device.ports is not None:
            address = SerialAddress(port=device.ports[place])
        else:
            address = SerialAddress(serial_number=(device.serial_numbers or ("", ""))[place])
        return lambda: _apt_line(address, clock)

    return Kpa101Pair((line(0), line(1)), (head(0), head(1)), device.rate_hz, clock=clock, hurry=hurry)


def _apt_line(address: SerialAddress, clock: Clock) -> Transport:
    opened = open_serial(address, KPA101_BAUD)
    try:
        opened.begin_apt(clock)
    except BaseException:
        opened.close()
        raise
    return opened


def _error_maps(device: PsdDevice) -> tuple[ErrorMap | None, ErrorMap | None]:
    one, other = device.error_maps or ("", "")
    try:
        return (ErrorMap.load(Path(one)) if one else None, ErrorMap.load(Path(other)) if other else None)
    except (ValueError, OSError) as error:
        raise DeviceRefused(f"error_maps in [devices.psd] of the rig file: {error}") from error


VIEWED = ("position_m", "good")  # channels that viewers show at once
LOOPBACK = "127.0.0.1"  # where datagrams are awaited when the rig file names no address of this machine


def tracker_driver(device: TrackerDevice, clock: Clock, hurry: float = 1.0) -> LineTracker:
    """Not connected yet. DeviceRefused for values that no driver takes.

    `hurry`: device seconds in one second of this program's clock; an instrument is triggered so much more often.
    """
    names = device.members if device.driver is TrackerDriver.JSON_LINES else device.columns
    try:
        return LineTracker(
            _line(device),
            _parse(device),
            device.rate_hz * (hurry if device.trigger else 1.0),
            dialogue=Dialogue(device.start.encode(), device.stop.encode(), device.trigger.encode()),
            whole_lines=device.transport == "udp",
            temperature="temperature" in names,
            clock=clock,
        )
    except ValueError as error:
        raise DeviceRefused(f"[devices.tracker] of the rig file: {error}") from error


def emulated_tracker(device: TrackerDevice, announced: Mapping[str, Any]) -> TrackerDevice:
    """The same instrument where emulators announced it: "host" and "port", or "serial_port"."""
    found = {"host": None, "port": None, "serial_port": None, "serial_number": None, **announced}
    return structs.replace(device, **found)


def _parse(device: TrackerDevice) -> Parse:
    units = Units(LENGTH_UNITS[device.length_unit], TIME_UNITS[device.time_unit], device.good)
    if device.driver is TrackerDriver.JSON_LINES:
        return json_lines(device.members, units)
    return ascii_lines(device.columns, device.separator, device.decimal, units)


def _line(device: TrackerDevice) -> Callable[[], Transport]:
    if device.is_serial:
        address = SerialAddress(port=device.serial_port, serial_number=device.serial_number)
        return lambda: open_serial(address, device.baud)
    port = device.port or 0  # there is one: acquisition/recording/rig/rules.py
    if device.transport == "udp":
        return lambda: UdpReceiver(device.host or LOOPBACK, port)
    return lambda: TcpLine(device.host or "", port)


def place_of(device: TrackerDevice) -> str:
    """Where it is, for a person."""
    if device.is_serial:
        return device.serial_port or f"USB serial number {device.serial_number}"
    return f"{'UDP ' if device.transport == 'udp' else ''}{device.host or LOOPBACK}:{device.port}"


@contextmanager
def camera_sight(rig: Rig, clock: Clock, emulated: Mapping[str, Any] | None = None) -> Generator["Sight | None"]:
    """What a session aims by; None where the rig has no camera. `emulated`: where emulators announced it.

    RigFileError, AcquisitionError without a calibration; DeviceError where no picture comes.
    """
    if rig.camera is None:
        yield None
        return
    from acquisition.centring.camera.board import Board, Sight
    from acquisition.centring.camera.model import read_model
    from acquisition.motion.kinematics import transform

    if rig.camera.calibration is None:
        raise RigFileError(
            f"rig {rig.name}: [camera] has no 'calibration'; measure the camera with `calibeam camera`, and name there "
            "the file that it writes (or take [camera] out: the light is then searched)"
        )
    model = read_model(Path(rig.camera.calibration), rig.camera)
    board = rig.camera.board
    with open_camera(rig.camera, clock, emulated) as eye:
        yield Sight(eye, model, Board(board), transform(board.in_psd1.origin_m, board.in_psd1.rotation_rad))


@contextmanager
def open_camera(camera: Camera, clock: Clock, emulated: Mapping[str, Any] | None = None) -> Generator["CameraDevice"]:
    """The camera itself, connected. DeviceError."""
    from drivers.camera.device import Camera as CameraDevice

    source = camera.source if emulated is None else str(emulated["source"])
    device = CameraDevice(source, (camera.width_px, camera.height_px), clock, camera.latency_s)
    device.connect()
    try:
        yield device
    finally:
        device.close()
