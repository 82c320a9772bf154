"""An emulated KPA101 on a TCP port of the host loop, for clients in their own process."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from simulators.host.loop import Host
from simulators.kpa101.emulator import Kpa101Unit, Kpa101Wire
from simulators.wire import Bench, TcpPort


class FixedLight:
    """3 V to the right, 1 V down, 4 V in sum, at a head of 100 kV/A."""

    time_s = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        """No noise here."""

    def photocurrents_a(self, times_s: np.ndarray) -> np.ndarray:
        return np.tile(np.array([0.5, 3.5, 2.5, 1.5, 0.0, 0.0, 0.0, 0.0]) * 1e-5, (len(times_s), 1))


@dataclass
class Served:
    host: str
    port: int
    unit: Kpa101Unit


@pytest.fixture
def unit() -> Kpa101Unit:
    return Kpa101Unit(FixedLight(), 0, 69250001, 1e5)


@pytest.fixture
def served() -> Iterator[Served]:
    world = FixedLight()
    unit = Kpa101Unit(world, 0, 69250001, 1e5)
    port = TcpPort("psd1", "127.0.0.1", 0, lambda: Kpa101Wire(unit, lambda: world.time_s))
    host = Host(Bench([unit], [port]), world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield Served(*host.tcp_address("psd1"), unit)
    finally:
        stop.set()
        thread.join()
        host.close()
