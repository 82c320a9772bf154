"""The emulated thermometer: the room of the emulated world, once every half second."""

from collections.abc import Mapping
from typing import Any

from simulators.wire import Bench, TcpPort

PERIOD_S = 0.5
ROOM_DEGC = 21.5


class ThermometerWire:
    """One client. Does not imitate: the sensor's own lag."""

    def __init__(self, world: Any) -> None:
        self._world, self._next_s = world, 0.0

    def handle(self, data: bytes) -> bytes:
        return b""

    def due(self) -> bytes:
        if self._world.time_s < self._next_s:
            return b""
        self._next_s = self._world.time_s + PERIOD_S
        return f"{ROOM_DEGC:.2f}\r\n".encode()


def build(world: Any, settings: Mapping[str, Any]) -> Bench:
    port = TcpPort("lab-thermometer", "127.0.0.1", int(settings.get("port", 0)), lambda: ThermometerWire(world))
    return Bench([], [port])
