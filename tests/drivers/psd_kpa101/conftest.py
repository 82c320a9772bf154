"""Two emulated KPA101 for the driver: on lines in memory whose time is the test's, and on real pseudo-terminals."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from drivers.errors import DeviceLost
from drivers.psd_faces import FaceKind
from drivers.psd_kpa101.pair import Head, Kpa101Pair, Wiring
from simulators.host.loop import Host
from simulators.kpa101.emulator import build
from simulators.wire import Bench

LENGTH_M = 0.01
RIG = {"devices": {"psd": {"serial_numbers": ["69250001", "69250002"], "transimpedance_v_a": 1e5}}}


class SpotsOnFaces:
    """A spot on each face that the test places; time is what the lines, or the host loop, say."""

    def __init__(self) -> None:
        self.time_s = 10.0
        self.spots_m = [(1.0e-3, -2.0e-3), (0.5e-3, 0.25e-3)]
        self.light_a = [40e-6, 12e-6]

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def psd_rate(self, rate_hz: float) -> None:
        """No noise here."""

    def photocurrents_a(self, times_s: np.ndarray) -> np.ndarray:
        """Each of two layers carries the photocurrent and divides it like a lever."""
        row: list[float] = []
        for (x_m, y_m), light_a in zip(self.spots_m, self.light_a, strict=True):
            right, top = 0.5 + x_m / LENGTH_M, 0.5 + y_m / LENGTH_M
            row += [light_a * (1.0 - right), light_a * right, light_a * (1.0 - top), light_a * top]
        return np.tile(row, (len(times_s), 1))


class WorldClock:
    """The world's time is the program's; it passes only while somebody waits."""

    def __init__(self, world: SpotsOnFaces, bench: Bench) -> None:
        self._world, self._bench = world, bench

    def now_s(self) -> float:
        return self._world.time_s

    def sleep_s(self, seconds: float) -> None:
        self._world.time_s += seconds
        for instrument in self._bench.instruments:
            instrument.after_step(self._world.time_s)


@dataclass
class MemoryLine:
    """The line to one unit. `spoil` turns what the unit says into what arrives."""

    name: str
    wire: object
    clock: WorldClock
    spoil: Callable[[bytes], bytes] = lambda data: data
    waiting: bytes = b""
    lost: bool = False
    closed: int = 0
    written: list[bytes] = field(default_factory=list)

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        if self.lost:
            raise DeviceLost(f"{self.name}: gone")
        until_s = self.clock.now_s() + timeout_s
        while not self.waiting and self.clock.now_s() < until_s:
            self.clock.sleep_s(min(0.0005, until_s - self.clock.now_s()))
            self.waiting += self.spoil(self.wire.due())
        data, self.waiting = self.waiting[:max_bytes], self.waiting[max_bytes:]
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        if self.lost:
            raise DeviceLost(f"{self.name}: gone")
        self.written.append(data)
        self.waiting += self.spoil(self.wire.handle(data))

    def close(self) -> None:
        self.closed += 1


@dataclass
class Pair:
    psd: Kpa101Pair
    lines: tuple[MemoryLine, MemoryLine]
    world: SpotsOnFaces
    bench: Bench
    clock: WorldClock


def heads(**wiring: float) -> tuple[Head, Head]:
    each = Wiring(**wiring)
    return (Head(FaceKind.PIN_CUSHION, LENGTH_M, each), Head(FaceKind.PIN_CUSHION, LENGTH_M, each))


@pytest.fixture
def in_memory() -> Pair:
    world = SpotsOnFaces()
    bench = build(world, RIG)
    clock = WorldClock(world, bench)
    one, two = (MemoryLine(port.name, port.wire, clock) for port in bench.ports)
    psd = Kpa101Pair((lambda: one, lambda: two), heads(), 200.0, clock=clock)
    return Pair(psd, (one, two), world, bench, clock)


@dataclass
class Served:
    ports: tuple[str, str]
    world: SpotsOnFaces
    bench: Bench


@pytest.fixture
def served() -> Iterator[Served]:
    world = SpotsOnFaces()
    bench = build(world, RIG)
    host = Host(bench, world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield Served((host.serial_address("psd1"), host.serial_address("psd2")), world, bench)
    finally:
        stop.set()
        thread.join()
        host.close()
