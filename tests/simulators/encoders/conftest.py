"""Emulated encoders: on a table without I/O, and served on a real pseudo-terminal by the host loop in a thread."""

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest

from simulators.encoders.emulator import build
from simulators.encoders.node import EncoderNode
from simulators.host.loop import Host
from simulators.wire import TICK_S, Bench

NODES = [1, 2, 3, 4, 5, 6]
BITRATE = 1_000_000


class Shafts:
    """Six shafts at angles that the test sets."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.angle_rad = np.array([math.tau / 4, -math.tau / 4, 0.0, 1.0, 2.0, 10 * math.tau + 0.5])

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return self.angle_rad


def bench_over(world: Shafts, bitrate: int = BITRATE) -> Bench:
    return build(world, {"devices": {"encoders": {"nodes": NODES, "bitrate": bitrate, "channel": "can0"}}})


class AdapterOnTable:
    """The serial adapter of a bench, advanced tick by tick in the order of simulators/wire.py."""

    def __init__(self, bitrate: int = BITRATE) -> None:
        self.world = Shafts()
        self.bench = bench_over(self.world, bitrate)
        self.wire = self.bench.ports[0].wire

    def send(self, *lines: str) -> bytes:
        return self.wire.handle("".join(line + "\r" for line in lines).encode())

    def run(self, seconds: float) -> list[str]:
        """Lines that came, in order."""
        came = b""
        for _ in range(round(seconds / TICK_S)):
            t_s = self.world.time_s
            self.world.time_s = round(t_s + TICK_S, 9)
            for instrument in self.bench.instruments:
                instrument.after_step(t_s)
            came += self.wire.due()
        return came.decode().split("\r")[:-1]

    def open(self) -> None:
        """Open at 1 Mbit/s; boot-up messages are over."""
        self.run(0.01)
        assert self.send("S8", "O") == b"\r\r"


@pytest.fixture
def adapter() -> AdapterOnTable:
    return AdapterOnTable()


@pytest.fixture
def node() -> EncoderNode:
    """Node 1 at a quarter turn, its boot-up message taken."""
    single = EncoderNode(1, lambda: math.tau / 4)
    single.due(0.0)
    return single


@dataclass
class Served:
    channel: str
    world: Shafts
    verbs: dict[str, Callable[..., object]]


@pytest.fixture
def served() -> Iterator[Served]:
    world = Shafts()
    bench = bench_over(world)
    host = Host(bench, world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield Served(host.serial_address("can"), world, dict(bench.verbs))
    finally:
        stop.set()
        thread.join()
        host.close()
