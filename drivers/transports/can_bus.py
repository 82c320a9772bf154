"""A CAN bus through any adapter that python-can knows: opened by its name in the rig file, logged raw, with its faults.

Faults: error frames, and the end of all sending, bus-off. Source of the bits: Linux, include/uapi/linux/can/error.h;
python-can hands such frames on as they are, and other adapters' error frames without bits. python-can and canopen raise
CanError, OSError and pyserial's exceptions when an adapter is unplugged: here they become DeviceLost, with the cause
kept. What cannot be opened is one DeviceLost.

For raw logs, a bus can pass every frame, sent and received, to a second receiver before the driver takes it.
"""

import difflib
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import can
from serial import SerialException
from serial.tools import list_ports

from drivers.errors import DeviceError, DeviceLost
from drivers.transports.serial_port import find_port
from drivers.transports.slcan_bus import BlockSlcanBus
from drivers.transports.slcan_stamps import MinuteClock, StampedSlcanBus

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
    stamped: bool = False,
    ports: Callable[[], Iterable[Any]] = list_ports.comports,
) -> OpenBus:
    """How to open a bus of any python-can interface, from these arguments only: no configuration file is read.

    `options` are further words of python-can for that interface. With a `serial_number` the port of a serial adapter is
    looked up by its USB plug at every opening, so that an adapter that comes back elsewhere is found. `stamped`: an
    adapter of interface slcan is asked for its time stamps.
    """
    settings: dict[str, Any] = {"sleep_after_open": SLCAN_SETTLE_S} if interface == "slcan" else {}
    settings |= options or {}
    minutes = MinuteClock()

    def open_bus() -> can.BusABC:
        _check_interface(interface)
        where = channel if serial_number is None else find_port(serial_number, ports)
        if interface == "slcan" and stamped:
            return StampedSlcanBus(where, minutes, bitrate=bitrate, **settings)
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


Tap = Callable[[Sequence[can.Message], bool], None]  # frames, in order; True when this side sent them


class TappedBus(can.BusABC):
    """Passes everything on to `bus`, which it owns. `tap` is called in the thread that sends or receives."""

    def __init__(self, bus: can.BusABC, tap: Tap) -> None:
        super().__init__(channel=bus.channel_info)
        self.channel_info = bus.channel_info
        self._can_protocol = bus.protocol
        self._bus, self._tap = bus, tap

    def recv(self, timeout: float | None = None) -> can.Message | None:
        message = self._bus.recv(timeout)
        if message is not None:
            self._tap((message,), False)
        return message

    def recv_all(self, timeout: float) -> list[can.Message]:
        """As `received`: one call of the tap for all of them."""
        messages = received(self._bus, timeout)
        if messages:
            self._tap(messages, False)
        return messages

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._bus.send(msg, timeout)
        self._tap((msg,), True)

    def shutdown(self) -> None:
        super().shutdown()
        self._bus.shutdown()

    def fileno(self) -> int:
        return self._bus.fileno()

    @property
    def state(self) -> can.BusState:
        return self._bus.state

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        self._bus.state = new_state

    @property
    def serialPortOrig(self) -> Any:  # python-can's name: whoever closes a bus whose adapter has gone asks for it
        return getattr(self._bus, "serialPortOrig", None)


def tapped(open_bus: OpenBus, tap: Tap) -> OpenBus:
    """The same bus, opened the same way, with `tap` on it."""
    return lambda: TappedBus(open_bus(), tap)


GONE = (can.CanError, SerialException, OSError)
FAULTS_KEPT = 256
BUS_OFF = 0x40  # CAN_ERR_BUSOFF
CLASSES = {  # bit of the identifier -> what it stands for
    0x001: "transmit timeout",
    0x002: "lost arbitration",
    0x004: "controller",
    0x008: "protocol violation",
    0x010: "transceiver",
    0x020: "no acknowledgement: no other node on the bus, or another bit rate",
    0x040: "bus off",
    0x080: "bus error",
    0x100: "controller restarted",
}


@dataclass(frozen=True)
class BusFault:
    """One error frame."""

    host_s: float
    bits: int
    data: bytes

    def __str__(self) -> str:
        said = [words for bit, words in CLASSES.items() if self.bits & bit]
        return ", ".join(said) or "error frame"


class BusFaults:
    """Counts the error frames and keeps the newest. `take` raises DeviceLost when the controller is bus-off."""

    def __init__(self, name: str) -> None:
        self.count = 0
        self.newest: tuple[BusFault, ...] = ()
        self._name = name

    def take(self, message: can.Message, host_s: float) -> None:
        """An error frame."""
        fault = BusFault(host_s, message.arbitration_id & 0x1FF, bytes(message.data))
        self.count += 1
        self.newest = (*self.newest, fault)[-FAULTS_KEPT:]
        if fault.bits & BUS_OFF:
            raise self._bus_off()

    def check(self, bus: can.BusABC) -> None:
        """DeviceLost when the adapter itself reports bus-off. One that cannot report is taken as healthy."""
        try:
            state = bus.state
        except (NotImplementedError, can.CanError):
            return
        if state is can.BusState.ERROR:
            raise self._bus_off()

    def _bus_off(self) -> DeviceLost:
        seen = f" after {self.count} error frames, the last: {self.newest[-1]}" if self.newest else ""
        return DeviceLost(
            f"{self._name}: the CAN controller is bus-off{seen}; check bit rate, termination (60 Ohm across the lines) "
            "and wiring, then connect again"
        )


@contextmanager
def lost_as_device_lost(name: str, doing: str) -> Generator[None]:
    """Converts what python-can raises when its adapter has gone."""
    try:
        yield
    except DeviceError:  # ours already, though DeviceLost and DeviceStale are OSErrors too
        raise
    except GONE as cause:
        raise DeviceLost(f"{name}: CAN adapter gone while {doing} ({cause}); check its cable and power") from cause


def shut_down(bus: can.BusABC) -> None:
    """Releases the bus also when its adapter has gone.

    python-can's slcan first informs the adapter, and leaves the port open when that fails: then we close it.
    """
    try:
        bus.shutdown()
    except GONE:
        port: Any = getattr(bus, "serialPortOrig", None)
        if port is not None:
            with suppress(OSError):
                port.close()
