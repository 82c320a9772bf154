"""Emulated encoders for the driver: on a real pseudo-terminal, and on a bus in memory whose time is the test's."""

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import can
import numpy as np
import pytest

from drivers.cia406.device import Cia406Encoders
from simulators.encoders.bus import CanFrame
from simulators.encoders.emulator import build
from simulators.encoders.node import EncoderNode
from simulators.host.loop import Host

NODES = [1, 2, 3, 4, 5, 6]


class Shafts:
    """Six shafts turning at 0.5 rad/s of emulated time."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.start_rad = np.array([0.0, -1.0, 2.0, -3.0, 4.0, 100.0])

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return self.start_rad + 0.5 * self.time_s


@dataclass
class Served:
    channel: str
    world: Shafts
    verbs: dict[str, Callable[..., object]]
    unplug: Callable[[], None]


@pytest.fixture
def served() -> Iterator[Served]:
    world = Shafts()
    bench = build(world, {"devices": {"encoders": {"nodes": NODES, "bitrate": 1_000_000, "channel": "can0"}}})
    host = Host(bench, world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()

    def unplug() -> None:
        stop.set()
        thread.join()
        host.close()

    try:
        yield Served(host.serial_address("can"), world, dict(bench.verbs), unplug)
    finally:
        if not stop.is_set():
            unplug()


class TestClock:
    """Time passes only while somebody waits."""

    __test__ = False

    def __init__(self) -> None:
        self.t_s = 50.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_s(self, seconds: float) -> None:
        self.t_s += seconds


class MemoryBus(can.BusABC):
    """A python-can bus with nodes on it. Their answers take `delay_s`; an idle wait passes the test's time."""

    def __init__(self, nodes: list[EncoderNode], clock: TestClock) -> None:
        super().__init__(channel="memory")
        self.nodes, self.clock = nodes, clock
        self.delay_s = 0.001
        self.sent: list[tuple[float, can.Message]] = []
        self.lose: Callable[[CanFrame], bool] = lambda frame: False
        self.waiting: list[tuple[float, CanFrame]] = []  # when it arrives
        self.errors: list[can.Message] = []  # error frames, heard before anything else
        self.said = can.BusState.ACTIVE

    @property
    def state(self) -> can.BusState:
        return self.said

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        now_s = self.clock.now_s()
        self.sent.append((now_s, msg))
        frame = CanFrame(msg.arbitration_id, bytes(msg.data))
        for node in self.nodes:
            self.put(node.handle(frame, now_s))

    def put(self, frames: list[CanFrame]) -> None:
        """Frames on their way to the driver."""
        arrives_s = self.clock.now_s() + self.delay_s
        self.waiting += [(arrives_s, frame) for frame in frames if not self.lose(frame)]

    def recv(self, timeout: float | None = None) -> can.Message | None:
        for node in self.nodes:
            self.put(node.due(self.clock.now_s()))
        if self.errors:
            return self.errors.pop(0)
        until_s = self.clock.now_s() + (timeout or 0.0)
        if self.waiting and self.waiting[0][0] <= until_s:
            arrives_s, frame = self.waiting.pop(0)
            self.clock.t_s = max(self.clock.t_s, arrives_s)
            return can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False)
        self.clock.t_s = until_s
        return None


@dataclass
class InMemory:
    encoders: Cia406Encoders
    bus: MemoryBus
    nodes: list[EncoderNode]
    clock: TestClock

    def syncs_s(self) -> list[float]:
        """When SYNCs were sent."""
        return [t_s for t_s, message in self.bus.sent if message.arbitration_id == 0x080]


@pytest.fixture
def memory() -> Iterator[InMemory]:
    """Two nodes at 0.25 and -0.25 turns, SYNC at 100 Hz; not connected yet."""
    clock = TestClock()
    nodes = [EncoderNode(1, lambda: math.tau / 4), EncoderNode(2, lambda: -math.tau / 4)]
    bus = MemoryBus(nodes, clock)
    encoders = Cia406Encoders(lambda: bus, [1, 2], 100.0, clock=clock)
    yield InMemory(encoders, bus, nodes, clock)
    encoders.close()
    bus.shutdown()
