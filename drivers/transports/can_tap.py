"""A CAN bus that shows every frame, sent and received, to somebody else before the driver takes it: for raw logs."""

from collections.abc import Callable, Sequence
from typing import Any

import can

from drivers.transports.can_bus import OpenBus, received

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
    def serialPortOrig(self) -> Any:  # python-can's name: whoever closes a bus whose adapter has gone looks for it
        return getattr(self._bus, "serialPortOrig", None)


def tapped(open_bus: OpenBus, tap: Tap) -> OpenBus:
    """The same bus, opened the same way, with `tap` on it."""
    return lambda: TappedBus(open_bus(), tap)
