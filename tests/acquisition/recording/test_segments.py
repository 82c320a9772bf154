"""A log in segments: none is touched again, nothing between two is lost or doubled."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording.check_recording import check
from acquisition.recording.mcap.log_segments import Rotation, SegmentedRecording, SegmentStream, segments
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel, Gap

Open = Callable[..., RecordingWriter]


class Clock:
    def __init__(self) -> None:
        self.s = 1000.0

    def now_s(self) -> float:
        return self.s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def begin_log(open_writer: Open, clock: Clock, tmp_path: Path) -> Callable[..., SegmentedRecording]:
    def begin(rotation: Rotation | None = None) -> SegmentedRecording:
        def writer(path: Path, notes: Mapping[str, str]) -> RecordingWriter:
            return open_writer(path, notes=notes, clock=clock)

        return SegmentedRecording(tmp_path / "log", writer, clock, rotation or Rotation(age_s=60.0))

    return begin


def append(stream: SegmentStream, first: int, count: int) -> None:
    number = np.arange(first, first + count)
    stream.append(1000.0 + number, number, number, {"count": number})


def numbers(path: Path) -> list[int]:
    return read(path).streams["encoders"].values["count"].tolist()


def test_a_segment_that_is_old_enough_is_closed_and_the_next_goes_on(begin_log, clock: Clock) -> None:
    log = begin_log()
    stream = log.stream("encoders", (Channel("count", ""),))
    append(stream, 0, 50)
    assert log.rotate_if_due() is None
    clock.s += 61.0
    full = log.rotate_if_due()
    append(stream, 50, 30)
    log.close()
    first, second = segments(log.folder)
    assert full == first
    assert [first.name, second.name] == ["segment-0001.mcap", "segment-0002.mcap"]
    assert numbers(first) + numbers(second) == list(range(80))
    assert read(second).notes["segment_before"] == "segment-0001.mcap"
    assert check(read(first)) == check(read(second)) == ()


def test_a_segment_that_is_large_enough_is_closed(begin_log) -> None:
    log = begin_log(Rotation(size_bytes=20_000))
    stream = log.stream("encoders", (Channel("count", ""), Channel("noise", "")))
    rng = np.random.default_rng(0)
    for first in range(0, 5000, 500):
        number = np.arange(first, first + 500)
        stream.append(1000.0 + number, number, number, {"count": number, "noise": rng.normal(size=500)})
        log.writer.flush()
        log.rotate_if_due()
    log.close()
    files = segments(log.folder)
    assert len(files) > 2
    assert [number for file in files for number in numbers(file)] == list(range(5000))


def test_samples_lost_between_two_segments_are_a_gap_in_the_second(begin_log, clock: Clock) -> None:
    log = begin_log()
    stream = log.stream("encoders", (Channel("count", ""),))
    append(stream, 0, 10)
    clock.s += 61.0
    log.rotate_if_due()
    append(stream, 13, 10)
    log.close()
    (gap,) = read(segments(log.folder)[1]).streams["encoders"].gaps
    assert (gap.from_s, gap.to_s, gap.missing) == (1009.0, 1013.0, 3)


def test_a_log_that_was_killed_goes_on_in_a_new_segment(begin_log) -> None:
    log = begin_log()
    append(log.stream("encoders", (Channel("count", ""),)), 0, 10)
    log.writer.flush()  # and no close: the process is gone
    killed = segments(log.folder)[0].read_bytes()
    again = begin_log()
    append(again.stream("encoders", (Channel("count", ""),)), 0, 5)
    again.close()
    first, second = segments(log.folder)
    assert first.read_bytes() == killed
    assert numbers(first) == list(range(10))
    assert numbers(second) == list(range(5))
    assert read(second).notes == {"segment": "2", "segment_before": "segment-0001.mcap"}
    log.close()


def test_gaps_and_events_go_into_the_open_segment(begin_log, clock: Clock) -> None:
    log = begin_log()
    stream = log.stream("encoders", (Channel("count", ""),))
    clock.s += 61.0
    log.rotate_if_due()
    append(stream, 0, 10)
    stream.gap(Gap(1003.0, 1004.0, -1, "unplugged"))
    log.event("device lost", {"why": "unplugged"})
    log.close()
    second = read(segments(log.folder)[1])
    assert [event.kind for event in second.events] == ["device lost"]
    assert second.streams["encoders"].gaps == (Gap(1003.0, 1004.0, -1, "unplugged"),)
