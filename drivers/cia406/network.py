"""The CAN bus of the driver: python-can with a limit on every wait, canopen for SDO and NMT on top.

python-can and canopen raise CanError, OSError and pyserial's exceptions when an adapter has gone: here they become
DeviceLost, with the cause kept.
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from typing import Any

import can
import canopen
from serial import SerialException

from drivers.errors import DeviceError, DeviceLost

SEND_LIMIT_S = 0.5  # an adapter that takes no frame for so long has stopped
LISTEN_S = 0.02  # how soon the listening thread of the set-up ends when told
STOP_S = 5.0  # for its end, on a busy host: two readers of one bus would each get half of the frames
GONE = (can.CanError, SerialException, OSError)


class BoundedNetwork(canopen.Network):
    """canopen's network whose sending never waits without limit, as its own does on a full serial port."""

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        message = can.Message(arbitration_id=can_id, is_extended_id=can_id > 0x7FF, data=data, is_remote_frame=remote)
        if self.bus is None:
            raise can.CanOperationError("the bus is closed")
        with self.send_lock:
            self.bus.send(message, SEND_LIMIT_S)
        self.check()


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


class _Listener(can.Listener):
    """Shows every frame to `take` and keeps the error that ends the listening, which python-can would only print."""

    def __init__(self, take: Callable[[can.Message], None]) -> None:
        self._take = take
        self.error: Exception | None = None

    def on_message_received(self, msg: can.Message) -> None:
        self._take(msg)

    def on_error(self, exc: Exception) -> None:
        self.error = exc

    def stop(self) -> None:
        """Nothing to release."""


@contextmanager
def listening(network: canopen.Network, bus: can.BusABC, take: Callable[[can.Message], None]) -> Generator[None]:
    """Answers reach canopen for as long as this lasts, by a thread that ends with it; `take` sees every frame."""
    listener = _Listener(take)
    notifier = can.Notifier(bus, [*network.listeners, listener], LISTEN_S)
    try:
        yield
    except Exception as outcome:
        if listener.error is not None:  # the reason behind an answer that did not come
            raise can.CanOperationError(str(listener.error)) from outcome
        raise
    finally:
        notifier.stop(STOP_S)
