"""The instrument that a rig file's [devices.tracker] declares, for a session, a check, the live page and a log."""

from collections.abc import Callable, Mapping
from typing import Any

from msgspec import structs

from acquisition.recording.rig.devices import TrackerDevice, TrackerDriver
from drivers.clock import Clock
from drivers.errors import DeviceRefused
from drivers.tracker.codec import LENGTH_UNITS, TIME_UNITS, Parse, Units, ascii_lines, json_lines
from drivers.tracker.device import Dialogue, LineTracker
from drivers.transports.serial_port import SerialAddress, open_serial
from drivers.transports.transport import TcpLine, Transport, UdpReceiver

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
