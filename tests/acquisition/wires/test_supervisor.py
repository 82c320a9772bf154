"""The first failure stops the arm, whoever tells of it; a device that tells nothing is noticed by its age."""

import threading

import numpy as np
import pytest

from acquisition.errors import StoppedError
from acquisition.wires.attaching import Guarded
from acquisition.wires.streams import FROZEN_S, Supervisor
from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale, WireError


class Clock:
    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_the_first_failure_holds_the_arm_once() -> None:
    held: list[int] = []
    supervisor = Supervisor(lambda: held.append(1))
    supervisor.check()
    supervisor.failed(DeviceLost("psd: gone"))
    supervisor.failed(DeviceLost("robot: gone"))
    assert held == [1]
    with pytest.raises(DeviceLost, match="psd"):
        supervisor.check()


def test_an_arm_that_takes_no_stop_is_no_news_to_the_reader_thread() -> None:
    def refuse() -> None:
        raise DeviceLost("no way to the controller")

    supervisor = Supervisor(refuse)
    supervisor.failed(DeviceStale("psd: silent"))
    with pytest.raises(DeviceStale):
        supervisor.check()


def test_a_person_holds_the_arm_whatever_was_before() -> None:
    held: list[int] = []
    supervisor = Supervisor(lambda: held.append(1))
    supervisor.stop(StoppedError("STOP"))
    with pytest.raises(StoppedError):
        supervisor.check()
    supervisor.failed(DeviceLost("psd: gone"))
    supervisor.stop(StoppedError("STOP again"))
    assert held == [1, 1]


def test_a_stop_that_cannot_be_delivered_is_reported_and_ends_the_session_all_the_same() -> None:
    def refuse() -> None:
        raise DeviceLost("no way to the controller")

    supervisor = Supervisor(refuse)
    with pytest.raises(DeviceLost):
        supervisor.stop(StoppedError("STOP"))
    with pytest.raises(StoppedError):
        supervisor.check()


def test_old_samples_stop_the_arm(clock) -> None:
    held = threading.Event()
    supervisor = Supervisor(held.set, clock)
    with supervisor.watching("psd", lambda: 100.0, limit_s=0.5):
        clock.time_s = 100.6
        assert held.wait(5.0)
    with pytest.raises(DeviceStale, match=r"psd: its newest sample is 0\.60 s old, 0\.50 s are allowed"):
        supervisor.check()


def test_a_device_that_never_sends_is_old_too(clock) -> None:
    held = threading.Event()
    supervisor = Supervisor(held.set, clock)
    with supervisor.watching("psd", lambda: None, limit_s=0.5):
        assert not held.is_set()
        clock.time_s = 100.6
        assert held.wait(5.0)


def test_fresh_samples_are_left_alone(clock) -> None:
    looked = threading.Semaphore(0)

    def newest_s() -> float:
        looked.release()
        clock.time_s += 0.5  # more would be a freeze of this program
        return clock.time_s

    supervisor = Supervisor(lambda: None, clock)
    with supervisor.watching("psd", newest_s):
        for _ in range(3):
            assert looked.acquire(timeout=5.0)
    supervisor.check()
    assert all(not thread.name.startswith("watch") for thread in threading.enumerate())


class Raising:
    name = "psd"

    def __init__(self, error: Exception) -> None:
        self.error = error

    def connect(self) -> None:
        raise self.error

    def describe(self) -> tuple:
        return ()

    def read(self, timeout_s: float):
        raise self.error

    def close(self) -> None:
        raise self.error


@pytest.mark.parametrize(
    ("raised", "kind"),
    [
        (OSError(5, "Input/output error"), DeviceLost),
        (ConnectionResetError("reset"), DeviceLost),
        (TimeoutError("slow"), DeviceStale),
        (TypeError("'NoneType' has no fileno"), DeviceLost),  # pyserial, closed by another thread
        (np.linalg.LinAlgError("odd"), DeviceLost),
        (DeviceRefused("no"), DeviceRefused),
        (WireError("junk"), WireError),
    ],
)
def test_whatever_a_library_raises_is_one_of_ours(raised, kind) -> None:
    device = Guarded(Raising(raised))
    for act in (device.connect, lambda: device.read(1.0), device.close):
        with pytest.raises(DeviceError) as caught:
            act()
        assert type(caught.value) is kind
        assert caught.value is raised or caught.value.__cause__ is raised


@pytest.mark.parametrize("gap_s", [FROZEN_S - 0.1, 5.0])
def test_a_freeze_of_this_program_is_noticed_before_the_next_motion(clock, gap_s) -> None:
    """Whatever comes first after it: here no thread has looked yet, and the samples are fresh."""
    held: list[int] = []
    waits = threading.Event()
    supervisor = Supervisor(lambda: held.append(1), clock)

    def newest_s() -> float:
        waits.wait(10.0)
        return clock.time_s

    with supervisor.watching("psd", newest_s):
        supervisor.check()
        clock.time_s += gap_s
        if gap_s > FROZEN_S:
            with pytest.raises(DeviceStale, match=r"this program did not run for 5.0 s .* nothing that was asked for"):
                supervisor.check()
        else:
            supervisor.check()
        waits.set()
    assert bool(held) is (gap_s > FROZEN_S)


def test_what_lasts_long_while_nothing_is_watched_is_no_freeze(clock) -> None:
    supervisor = Supervisor(lambda: None, clock)
    clock.time_s += 60.0
    with supervisor.watching("psd", lambda: clock.time_s):
        supervisor.check()
