"""A log of days keeps its memory: segment after segment with a clock that jumps, and within one segment."""

import resource
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue

import can
import numpy as np
import pytest

from acquisition.recording import read
from acquisition.recording.mcap import Rotation, mcap_file, segments
from acquisition.recording.mcap.layout import EVENT, packed
from acquisition.recording.mcap.mcap_file import McapFile
from acquisition.recording.rig import parse_rig
from calibeam.devices import encoder_log
from calibeam.devices.encoder_log import LOOK_S, EncoderLog, LogState
from drivers.device import Block, Channel
from drivers.errors import DeviceStale
from drivers.transports.can_bus import Tap

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
ROWS = 20  # between two looks of the log
SEGMENTS_OF_A_DAY = 2_880  # of 30 s
DAY_BYTES = 50e6  # that a day may add to the memory of the program
PATIENCE_S = 30.0


@dataclass
class LockStep:
    """A clock whose every sleep is one block of the encoders, so that nothing depends on the machine's speed."""

    time_s: float = 100.0
    wanted: SimpleQueue[bool] = field(default_factory=SimpleQueue)
    made: SimpleQueue[bool] = field(default_factory=SimpleQueue)

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        self.time_s += seconds
        self.wanted.put(True)
        assert self.made.get(timeout=PATIENCE_S)


class Encoders:
    """Six encoders that answer as often as the clock asks, and the frames of their bus."""

    name = "encoders"

    def __init__(self, clock: LockStep, tap: Tap) -> None:
        self._clock, self._tap, self._rows, self._asked = clock, tap, 0, False

    def connect(self) -> None: ...

    def close(self) -> None: ...

    def describe(self) -> tuple[Channel, ...]:
        return (Channel("position_rad", "rad", (6,)), Channel("emergency_code", "", (6,)))

    def read(self, timeout_s: float) -> Block:
        if self._asked:  # what was asked for before has been kept: a pump reads again only then
            self._clock.made.put(True)
        self._asked = self._clock.wanted.get(timeout=PATIENCE_S)
        if not self._asked:
            raise DeviceStale("the test has ended")
        messages = [can.Message(arbitration_id=0x280 + node, data=bytes(4), is_extended_id=False) for node in range(7)]
        self._tap(messages, False)
        numbers = np.arange(self._rows, self._rows + ROWS)
        self._rows += ROWS
        times_s = np.full(ROWS, self._clock.now_s())
        values = {"position_rad": np.ones((ROWS, 6)), "emergency_code": np.zeros((ROWS, 6), dtype=np.int64)}
        return Block(times_s, times_s, numbers, values)


def grown(
    folder: Path, monkeypatch: pytest.MonkeyPatch, from_segment: int, to_segment: int, size: Callable[[], float]
) -> float:
    """By how much `size` grows between two segments of one log."""
    clock, sizes = LockStep(), dict[int, float]()
    monkeypatch.setattr(encoder_log, "encoder_driver", lambda device, clock, tap: Encoders(clock, tap))
    monkeypatch.setattr(mcap_file.os, "fsync", lambda descriptor: None)  # the disk's time, and no memory
    rotation = Rotation(age_s=2.5 * LOOK_S)  # three blocks each
    device = parse_rig(RIG.read_text(), "rig").devices.encoders
    assert device is not None
    log = EncoderLog(device, RIG.read_text(), folder, clock, rotation, raw=True)

    def note(state: LogState) -> None:
        if len(log.segments) in (from_segment, to_segment) and len(log.segments) not in sizes:
            sizes[len(log.segments)] = size()
        for path in log.segments[:-1][-1:]:
            if len(log.segments) > 2:  # the first is looked at afterwards
                path.unlink(missing_ok=True)

    def ended() -> bool:
        over = len(log.segments) > to_segment
        if over:
            clock.wanted.put(False)
        return over

    log.run(ended, note)
    assert read(segments(folder)[0]).streams["encoders"].sequence.size >= ROWS
    return sizes[to_segment] - sizes[from_segment]


def test_a_segment_leaves_nothing_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tracemalloc.start()
    try:
        held = grown(tmp_path / "log", monkeypatch, 10, 40, lambda: tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    # A day allows 17 kB for each; seen: 1.8 kB, with its name in the list of segments. A closed writer has 33 kB.
    print(f"{held / 30:.0f} bytes a segment")
    assert held / 30 < 5_000


@pytest.mark.endure
def test_as_many_segments_as_a_day_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def most_bytes() -> float:
        return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # Linux counts in KiB

    held = grown(tmp_path / "log", monkeypatch, 20, 20 + SEGMENTS_OF_A_DAY, most_bytes)
    print(f"{SEGMENTS_OF_A_DAY} segments: {held / 1e6:.1f} MB more")
    assert held < DAY_BYTES / 2.0  # the other half is for what a segment holds while it is open


class Nowhere:
    """A file that keeps nothing but its length."""

    def __init__(self, path: Path) -> None:
        self._size = 0

    def write(self, data: bytes) -> int:
        self._size += len(data)
        return len(data)

    def tell(self) -> int:
        return self._size

    def flush(self) -> None: ...

    def close(self) -> None: ...


def test_an_open_segment_keeps_a_hundred_bytes_a_batch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mcap_file, "create_file", Nowhere)
    file = McapFile(tmp_path / "open.mcap", "test")
    topics = [file.topic(f"/{number}", EVENT, {}) for number in range(3)]  # as a log has: encoders, view, frames
    data = packed(EVENT, {"host_s": 1.0})

    def written(batches: int) -> None:
        for number in range(batches):
            for topic in topics:
                file.write(topic, number, data)
            file.flush()

    written(10)
    tracemalloc.start()
    try:
        written(2_000)
        held = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    print(f"{held / 2_000:.0f} bytes a batch")
    assert (
        held / 2_000 < 150
    )  # the record of a batch in the index has 107 bytes; its buffer grows by an eighth at a time
    file.finish()
