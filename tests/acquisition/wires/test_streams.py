"""A reader thread keeps what it read, ends when told, and tells at once when its device fails."""

import threading

import numpy as np
import pytest

from acquisition.wires.streams import Pump, Supervisor
from drivers.clock import SystemClock
from drivers.device import Block
from drivers.errors import DeviceLost, DeviceStale


def block(host_s: float) -> Block:
    return Block(np.array([host_s]), np.array([host_s]), np.array([int(host_s)]), {"v": np.array([host_s])})


class Scripted:
    """A device that gives one block each time it is allowed to, then what it was told to do."""

    name = "scripted"

    def __init__(self) -> None:
        self.allowed = threading.Semaphore(0)
        self.fails: Exception | None = None
        self.closed = threading.Event()
        self.count = 0

    def connect(self) -> None: ...

    def describe(self) -> tuple:
        return ()

    def read(self, timeout_s: float) -> Block:
        while not self.allowed.acquire(timeout=0.05):
            if self.closed.is_set():
                raise DeviceLost("scripted: closed")
        if self.fails is not None:
            raise self.fails
        self.count += 1
        return block(self.count)

    def close(self) -> None:
        self.closed.set()


@pytest.fixture
def running():
    device, kept, failures = Scripted(), [], []
    released = threading.Event()

    def failed(failure: Exception) -> None:
        failures.append(failure)
        released.set()

    pump = Pump(device, SystemClock(), kept.append, failed, stale_s=0.1)
    pump.start()
    yield device, pump, kept, failures, released
    device.closed.set()
    pump.stop()


def test_blocks_go_to_the_sink_and_into_the_memory(running) -> None:
    device, pump, kept, _, _ = running
    device.allowed.release(3)
    blocks = pump.wait(2.5, timeout_s=2.0)
    assert [b.host_s[0] for b in blocks] == [3.0]
    assert [b.host_s[0] for b in pump.recent(0.5)] == [1.0, 2.0, 3.0]
    assert pump.latest().host_s[0] == 3.0
    pump.stop()
    assert [b.host_s[0] for b in kept] == [1.0, 2.0, 3.0]


def test_a_failing_device_is_reported_at_once_and_raised_to_who_waits(running) -> None:
    device, pump, _, failures, released = running
    device.fails = DeviceLost("psd: unplugged")
    device.allowed.release()
    assert released.wait(2.0)
    assert str(failures[0]) == "psd: unplugged"
    with pytest.raises(DeviceLost, match="unplugged"):
        pump.wait(0.0, timeout_s=1.0)


def test_a_wait_without_samples_ends_as_stale(running) -> None:
    _, pump, _, _, _ = running
    with pytest.raises(DeviceStale, match=r"no sample for 0\.01 s"):
        pump.wait(0.0, timeout_s=0.01)


def test_a_stopped_pump_reports_no_failure_and_closes_its_device(running) -> None:
    device, pump, _, failures, _ = running
    device.closed.set()
    pump._stopping.set()
    pump.stop()
    assert failures == []
    assert pump.failure is None
    pump.stop()  # again


def test_a_sink_that_cannot_write_stops_the_stream() -> None:
    device, failures, released = Scripted(), [], threading.Event()

    def full(_: Block) -> None:
        raise OSError("disk full")

    def failed(failure: Exception) -> None:
        failures.append(failure)
        released.set()

    pump = Pump(device, SystemClock(), full, failed)
    pump.start()
    device.allowed.release()
    assert released.wait(2.0)
    assert str(failures[0]) == "disk full"
    device.closed.set()
    pump.stop()


def test_an_arm_that_does_not_take_the_stop_leaves_the_first_failure_the_news() -> None:
    def gone() -> None:
        raise DeviceLost("robot: the dashboard does not answer")

    supervisor = Supervisor(gone)
    supervisor.failed(DeviceStale("first"))
    with pytest.raises(DeviceStale, match="first"):
        supervisor.check()


def test_the_supervisor_stops_the_arm_once_and_keeps_the_first_failure() -> None:
    stops = []
    supervisor = Supervisor(lambda: stops.append(1))
    supervisor.check()
    supervisor.failed(DeviceLost("first"))
    supervisor.failed(DeviceStale("second"))
    assert stops == [1]
    with pytest.raises(DeviceLost, match="first"):
        supervisor.check()
