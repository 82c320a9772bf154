"""The detector instrument that a rig file names, for a session and for a check."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from msgspec import structs

from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import PsdDevice, PsdDriver
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
from drivers.transports.serial_port import SerialAddress, open_serial
from drivers.transports.transport import Transport

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
