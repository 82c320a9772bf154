"""What a CAN controller says of its bus: error frames, and the end of all sending, bus-off.

Source of the bits: Linux, include/uapi/linux/can/error.h; python-can hands such frames on as they are, and other
adapters' error frames without bits. python-can and canopen raise CanError, OSError and pyserial's exceptions when an
adapter has gone: here they become DeviceLost, with the cause kept.
"""

from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import can
from serial import SerialException

from drivers.errors import DeviceError, DeviceLost

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
        """DeviceLost when the adapter itself says that it is bus-off. One that cannot tell is believed healthy."""
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

    python-can's slcan first tells the adapter, and leaves the port open when that fails: then we close it.
    """
    try:
        bus.shutdown()
    except GONE:
        port: Any = getattr(bus, "serialPortOrig", None)
        if port is not None:
            with suppress(OSError):
                port.close()
