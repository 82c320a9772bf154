"""A PSD box on a real pseudo-terminal: the emulator and its host loop in a thread, over a world that stands still."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from simulators.host.loop import Host
from simulators.psd_daq.emulator import build
from simulators.wire import Bench

CURRENTS_A = np.array(
    [90e-6, 110e-6, 100e-6, 100e-6, 0.0, 0.0, 1e-9, 0.0]
)  # psd1 lit 1 mm beside its centre, psd2 dark


class StillWorld:
    """Fixed currents; time is what the host loop says."""

    time_s = 0.0
    psd_temperature_degC = 24.5
    rate_hz = 0.0

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz

    def photocurrents_a(self, times_s: np.ndarray) -> np.ndarray:
        return np.tile(CURRENTS_A, (len(times_s), 1))


@dataclass
class Served:
    port: str
    bench: Bench


@pytest.fixture
def psd_box() -> Iterator[Served]:
    world = StillWorld()
    bench = build(world, {"fixture": {"half_size_m": 0.01}, "devices": {"psd": {"serial_number": "CB-0007"}}})
    host = Host(bench, world, time_scale=4.0)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield Served(host.serial_address("psd"), bench)
    finally:
        stop.set()
        thread.join()
        host.close()
