"""The emulated PSD box without any I/O, over a world whose currents and time the test sets."""

from collections.abc import Callable

import numpy as np
import pytest

from simulators.psd_daq.emulator import PsdDaqWire, build
from simulators.wire import TICK_S, Bench


class SetWorld:
    """Currents are a function of time; every request for them is noted."""

    psd_temperature_degC = 24.5

    def __init__(self) -> None:
        self.time_s = 0.0
        self.rate_hz = 0.0
        self.asked_s: list[float] = []
        self.currents_a: Callable[[float], list[float]] = lambda t_s: [100e-6] * 8

    def psd_rate(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz

    def photocurrents_a(self, times_s: list[float]) -> np.ndarray:
        self.asked_s += times_s
        return np.array([self.currents_a(t_s) for t_s in times_s])


class BoxOnTable:
    """World, bench and wire, advanced tick by tick in the order of simulators/wire.py."""

    def __init__(self, baud: int) -> None:
        self.world = SetWorld()
        rig = {"fixture": {"half_size_m": 0.01}, "devices": {"psd": {"port": "out/psd"}}}
        self.bench: Bench = build(self.world, rig, baud)
        self.wire = self.bench.ports[0].wire
        assert isinstance(self.wire, PsdDaqWire)

    def run(self, seconds: float) -> list[tuple[float, bytes]]:
        """(emulated time, bytes) of every tick that sent something."""
        sent = []
        for _ in range(round(seconds / TICK_S)):
            t_s = self.world.time_s
            self.world.time_s = round(t_s + TICK_S, 9)
            for instrument in self.bench.instruments:
                instrument.after_step(t_s)
            data = self.wire.due()
            if data:
                sent.append((self.world.time_s, data))
        return sent

    def ask(self, request: bytes) -> bytes:
        return self.wire.handle(request) + b"".join(data for _, data in self.run(0.02))


@pytest.fixture
def box() -> BoxOnTable:
    return BoxOnTable(baud=3_000_000)


@pytest.fixture
def slow_box() -> BoxOnTable:
    """At 115200 baud: 11.5 kB/s, a third of what 1 kHz needs."""
    return BoxOnTable(baud=115_200)
