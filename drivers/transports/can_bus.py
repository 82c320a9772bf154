"""Every CAN adapter that python-can knows, by its name in the rig file; what cannot be opened is one DeviceLost."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import can
from serial.tools import list_ports

from drivers.errors import DeviceError, DeviceLost
from drivers.transports.serial_port import find_port
from drivers.transports.slcan_bus import BlockSlcanBus

SLCAN_SETTLE_S = 0.05  # python-can waits 2 s by default, for boards that reset when opened; ours need not
MOST_AT_ONCE = 64  # ten rows of six encoders: a bus that is flooded does not keep the SYNC waiting
OpenBus = Callable[[], can.BusABC]


def bus_opener(
    interface: str,
    channel: str,
    bitrate: int,
    options: Mapping[str, Any] | None = None,
    *,
    serial_number: str | None = None,
    ports: Callable[[], Iterable[Any]] = list_ports.comports,
) -> OpenBus:
    """How to open a bus of any python-can interface, from these arguments only: no configuration file is read.

    `options` are further words of python-can for that interface. With a `serial_number` the port of a serial adapter is
    looked up by its USB plug at every opening, so that an adapter that comes back elsewhere is found.
    """
    settings: dict[str, Any] = {"sleep_after_open": SLCAN_SETTLE_S} if interface == "slcan" else {}
    settings |= options or {}

    def open_bus() -> can.BusABC:
        _check_interface(interface)
        where = channel if serial_number is None else find_port(serial_number, ports)
        if interface == "slcan":
            return BlockSlcanBus(where, bitrate=bitrate, **settings)
        return can.Bus(where, interface=interface, bitrate=bitrate, ignore_config=True, **settings)

    return open_bus


def interfaces() -> tuple[str, ...]:
    """Names that a rig file may use, of python-can and of what is installed beside it."""
    return tuple(sorted(can.VALID_INTERFACES))


def opened(open_bus: OpenBus, name: str) -> can.BusABC:
    """The open bus. DeviceLost naming the cause when there is none.

    Vendors' libraries fail in their own ways when they are missing, older, or have no adapter: NameError, TypeError,
    AttributeError, OSError and CanError have been seen. None of them is a fault of this program that could be mended
    by showing it, so all become DeviceLost here, with the cause kept.
    """
    try:
        return open_bus()
    except DeviceError:
        raise
    except Exception as cause:
        raise DeviceLost(
            f"{name}: the CAN bus cannot be opened ({type(cause).__name__}: {cause}); check the adapter "
            "and its driver, and interface, channel, bitrate and options in the rig file"
        ) from cause


def received(bus: can.BusABC, timeout_s: float) -> list[can.Message]:
    """All frames that are there, at most MOST_AT_ONCE; when there is none yet, waits for the first."""
    at_once: Callable[[float], list[can.Message]] | None = getattr(bus, "recv_all", None)
    if at_once is not None:
        return at_once(timeout_s)
    messages: list[can.Message] = []
    message = bus.recv(timeout_s)
    while message is not None:
        messages.append(message)
        if len(messages) == MOST_AT_ONCE:
            break
        try:
            message = bus.recv(0.0)
        except can.CanError:  # an adapter that has gone raises it again, when what came before is taken
            break
    return messages


def _check_interface(interface: str) -> None:
    """ValueError for a name that python-can does not know, or one that loses frames."""
    if interface == "udp_multicast":
        raise ValueError("interface 'udp_multicast' loses frames: 12 % of 20 000 on a quiet machine; use another")
    if interface not in can.VALID_INTERFACES:
        near = difflib.get_close_matches(interface, interfaces(), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(interfaces())}"
        raise ValueError(f"unknown interface {interface!r}; {hint}")
