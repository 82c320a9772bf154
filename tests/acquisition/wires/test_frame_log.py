"""Every frame goes into the recording once, in order, from whichever thread it was heard."""

import threading

import can
import numpy as np
import pytest

from acquisition.recording import RecordingError
from acquisition.recording.can_frames import FrameFlag
from acquisition.wires.frame_log import BLOCK_S, FrameLog, frame_stamps


class Clock:
    def __init__(self) -> None:
        self.s = 50.0

    def now_s(self) -> float:
        return self.s

    def sleep_s(self, seconds: float) -> None:
        self.s += seconds


class Kept:
    """One stream of a recording."""

    def __init__(self, width: int = 8) -> None:
        self.width = width
        self.sequence: list[int] = []
        self.ids: list[int] = []
        self.flags: list[int] = []
        self.host_s: list[float] = []
        self.blocks = 0

    def append(self, host_s, device_s, sequence, values) -> None:
        self.blocks += 1
        self.host_s += host_s.tolist()
        self.sequence += sequence.tolist()
        self.ids += values["can_id"].tolist()
        self.flags += values["flags"].tolist()
        assert values["data"].shape == (len(host_s), self.width)


class Recorded:
    """A recording; on a full disk it takes nothing."""

    def __init__(self) -> None:
        self.streams: dict[str, Kept] = {}

    def stream(self, name, channels, viewer=None, stamps="unknown") -> Kept:
        self.streams[name] = Kept(channels[-1].shape[0])
        return self.streams[name]


@pytest.fixture
def recorded() -> Recorded:
    return Recorded()


def frame(number: int, **kind: bool) -> can.Message:
    return can.Message(timestamp=5.0, arbitration_id=number, is_extended_id=False, data=bytes([number % 256]), **kind)


def test_frames_wait_for_a_block_and_are_written_in_order(recorded) -> None:
    clock = Clock()
    log = FrameLog(recorded, clock)
    kept = recorded.streams["can"]
    for number in range(100):
        log.hear([frame(number)], number % 7 == 0)
        clock.s += 0.001
    written_by_itself = kept.blocks
    log.flush()
    assert 1 < written_by_itself <= 0.1 / BLOCK_S
    assert kept.sequence == kept.ids == list(range(100))
    assert [bool(flag & FrameFlag.SENT) for flag in kept.flags] == [number % 7 == 0 for number in range(100)]
    np.testing.assert_allclose(np.diff(kept.host_s), 0.001)
    assert log.count == 100


def test_long_frames_of_can_fd_stand_next_to_the_others_and_cost_none_of_them(recorded) -> None:
    log = FrameLog(recorded, Clock())
    for number in range(6):
        log.hear([frame(number)], False)
        log.hear([can.Message(arbitration_id=number, is_fd=True, data=bytes(12), dlc=12)], False)
    log.flush()
    assert (recorded.streams["can"].ids, recorded.streams["can-fd"].ids) == ([*range(6)], [*range(6)])
    assert recorded.streams["can-fd"].sequence == [*range(6)]
    assert recorded.streams["can-fd"].width == 64
    assert log.count == 12


def test_a_recording_that_failed_is_reported_by_flush_and_not_to_the_bus(recorded) -> None:
    clock = Clock()
    log = FrameLog(recorded, clock)

    def refuse(*_: object) -> None:
        raise RecordingError("disk full")

    recorded.streams["can"].append = refuse
    log.hear([frame(1)], False)
    clock.s += 1.0
    log.hear([frame(2)], False)
    with pytest.raises(RecordingError, match="disk full"):
        log.flush()


def test_error_frames_are_counted(recorded) -> None:
    log = FrameLog(recorded, Clock())
    log.hear([frame(1, is_error_frame=True)], False)
    log.hear([frame(2)], False)
    log.flush()
    assert (log.count, log.errors) == (2, 1)


def test_two_threads_lose_and_double_nothing(recorded) -> None:
    log = FrameLog(recorded, Clock())
    kept = recorded.streams["can"]

    def hear(first: int) -> None:
        for number in range(first, first + 1000):
            log.hear([frame(number % 0x7FF)], False)
            log.flush()

    threads = [threading.Thread(target=hear, args=(first,)) for first in (0, 1000)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert kept.sequence == list(range(2000))
    assert sorted(kept.ids) == sorted(number % 0x7FF for number in range(2000))


@pytest.mark.parametrize(
    ("interface", "asked", "stamps"),
    [
        ("socketcan", False, "arrived"),
        ("vector", False, "hardware"),
        ("pcan", False, "hardware"),
        ("slcan", False, "unknown"),
        ("slcan", True, "hardware"),
    ],
)
def test_frames_have_the_stamps_of_their_interface(interface: str, asked: bool, stamps: str) -> None:
    declared: list[str] = []

    class Declaring:
        def stream(self, name, channels, viewer=None, *, stamps="unknown"):
            declared.append(stamps)

    FrameLog(Declaring(), Clock(), frame_stamps(interface, asked=asked))
    assert declared == [stamps]
