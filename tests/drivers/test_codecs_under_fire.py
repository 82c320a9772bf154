"""Every codec of a line: whole, at every split, byte by byte, with junk around, and mutated at random.

Only declared outcomes, the second of two good frames after any damage is read, nothing is kept that a length field asks
for. 20 000 mutated inputs a codec on every day, 1 000 000 by `make endure`.
"""

import queue
import sys
import tracemalloc
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.can_dbc.description import joint_signals
from drivers.cia406.codec import emergency, heartbeat_state, mapped_number, mapped_object
from drivers.psd_daq.codec import PsdDaqCodec, frame
from drivers.psd_daq.messages import BadFrame, MessageType
from drivers.psd_kpa101.codec import Kpa101Codec
from drivers.psd_kpa101.messages import StrayBytes
from drivers.tracker.codec import BadLine, LineCodec, Units, ascii_lines, json_lines
from drivers.transports.slcan_bus import BlockSlcanBus
from simulators.kpa101 import emulator as kpa101

ROOT = Path(__file__).parents[2]
MOST_KEPT = 4096  # bytes that a codec may hold back


class SlcanLine(BlockSlcanBus):
    """The lines of a serial adapter without a port; what the parser refuses is a `ValueError`, as to the drivers."""

    def __init__(self) -> None:
        self._lines, self._begun, self._filters = deque(), "", None
        self._queue = queue.SimpleQueue()  # python-can's own, for frames that came while it waited for an answer
        self._is_shutdown = True

    def _waiting(self, timeout_s: float | None) -> bytes:
        return b""

    def feed(self, data: bytes) -> list[Any]:
        self._split(data)
        found: list[Any] = []
        while self._lines:
            try:
                message = self.recv(0.0)
            except (ValueError, IndexError) as refused:
                found.append(refused)
                continue
            found += [] if message is None else [(message.arbitration_id, message.is_extended_id, bytes(message.data))]
        return found


@dataclass(frozen=True)
class Line:
    """A codec, frames that its far end sends, and how it tells of damage."""

    make: Callable[[], Any]
    good: tuple[bytes, ...]
    damage: tuple[type, ...]


READING = kpa101.part(3, bytes.fromhex("0102030405060708090a"))
LINES = {
    "psd-daq": Line(
        PsdDaqCodec,
        (
            frame(MessageType.ACK, b"\x02"),
            frame(MessageType.NAK, b"\x02\x03\x04warm"),
            frame(MessageType.DATA, bytes(16) + b"\x01\0\0" + bytes(range(34))),
        ),
        (BadFrame,),
    ),
    "kpa101": Line(
        Kpa101Codec,
        (READING, kpa101.info(69250001, "KPA101", (1, 0, 7)), kpa101.refusal(0x0870, 3, "no"), kpa101.part(7, b"\1\0")),
        (StrayBytes,),
    ),
    "slcan": Line(
        SlcanLine, (b"t281400000400\r", b"T1ABCDEF0811223344AABBCCDD\r", b"t70115F\r"), (ValueError, IndexError)
    ),
    "ascii-lines": Line(
        lambda: LineCodec(ascii_lines(("time", "x", "y", "z", "status"), ";", ".", Units(1e-3, 1.0, ("0",)))),
        (b"1523.2;2104.51832;-310.00417;812.7731;0\r\n", b"1523.3;2104.5;-310;812.8;0;\n", b"7;-1.5e2;+3;.5;0\r"),
        (BadLine,),
    ),
    "json-lines": Line(
        lambda: LineCodec(json_lines({"x": "p.0", "y": "p.1", "z": "p.2", "time": "t"}, Units(1.0))),
        (b'{"t": 1.5, "p": [2.1, -0.31, 0.8]}\n', b'{"p":[1,2,3],"t":2,"more":{"a":null}}\r\n'),
        (BadLine,),
    ),
}


@pytest.fixture(params=LINES)
def line(request) -> Line:
    return LINES[request.param]


def read_all(line: Line, *pieces: bytes) -> list[str]:
    """Messages of the pieces in order, damage left out."""
    codec = line.make()
    messages = [message for piece in pieces for message in codec.feed(piece)]
    messages += codec.settle() if hasattr(codec, "settle") else []
    return [repr(message) for message in messages if not isinstance(message, line.damage)]


def kept_bytes(codec: Any) -> int:
    """What a codec holds of the stream."""
    held = [value for value in vars(codec).values() if isinstance(value, bytes | bytearray | str | deque | list)]
    return sum(len(value) for value in held)


def test_every_split_gives_the_same_messages(line):
    stream = b"".join(line.good)
    whole = read_all(line, stream)
    assert len(whole) == len(line.good)
    for cut in range(len(stream) + 1):
        assert read_all(line, stream[:cut], stream[cut:]) == whole
    assert read_all(line, *(bytes((byte,)) for byte in stream)) == whole


def test_junk_around_and_between_frames_costs_at_most_one_frame(line):
    rng = np.random.default_rng(7)
    for _ in range(300):
        junk = [rng.integers(0, 256, rng.integers(0, 60), dtype=np.uint8).tobytes() for _ in range(3)]
        for good in line.good:
            (expected,) = read_all(line, good)
            assert read_all(line, junk[0], good, good, junk[1], good, good, junk[2]).count(expected) >= 2


def test_a_frame_cut_anywhere_does_not_spoil_the_one_behind_the_next(line):
    for first in line.good:
        for second in line.good:
            (expected,) = read_all(line, second)
            for cut in range(len(first)):
                assert read_all(line, first[:cut], second, second)[-1] == expected


def mutated(rng: np.random.Generator, line: Line) -> bytes:
    """Some good frames, then one to four things that lines, adapters and firmware have been seen to do to bytes."""
    data = bytearray(b"".join(line.good[rng.integers(len(line.good))] for _ in range(rng.integers(1, 4))))
    for _ in range(rng.integers(1, 5)):
        at = int(rng.integers(0, len(data) + 1))
        many = int(rng.integers(1, 9))
        match int(rng.integers(7)):
            case 0 if at < len(data):
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                data[at : at + many] = rng.integers(0, 256, many, dtype=np.uint8).tobytes()
            case 2:
                del data[at : at + many]
            case 3:
                data[at:at] = rng.integers(0, 256, many, dtype=np.uint8).tobytes()
            case 4:
                data[at:at] = data[at : at + many]
            case 5:
                data[at : at + 2] = b"\xff\xff"  # what looks like the longest length
            case _:
                del data[at:]
    return bytes(data)


def under_fire(line: Line, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    codec = line.make()
    probes = [(good, read_all(line, good)[0]) for good in line.good]
    for number in range(count):
        data = mutated(rng, line)
        cut = int(rng.integers(0, len(data) + 1))
        codec.feed(data[:cut])
        codec.feed(data[cut:])
        assert kept_bytes(codec) <= MOST_KEPT, data.hex()
        good, expected = probes[number % len(probes)]
        messages = codec.feed(good) + codec.feed(good)
        messages += codec.settle() if hasattr(codec, "settle") else []
        assert repr(messages[-1]) == expected, (data.hex(), cut)


def test_mutated_input_gives_declared_outcomes_and_the_next_frames_are_read(line):
    under_fire(line, 20_000, seed=11)


@pytest.mark.endure
def test_a_million_mutated_inputs(line):
    under_fire(line, 1_000_000, seed=12)


def test_no_length_field_reserves_memory(line):
    """Every four bytes of every frame at their largest: nothing near what such a length would ask for."""
    inputs = [good[:at] + b"\xff\xff\xff\xff" + good[at + 4 :] for good in line.good for at in range(len(good))]
    codec = line.make()
    for data in inputs:
        codec.feed(data)
    tracemalloc.start()
    try:
        for data in inputs:
            codec.feed(data)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 65536 + sum(map(len, inputs))
    assert sys.getsizeof(codec) < MOST_KEPT


# --- frames of CAN, which come whole: any data, any length


def frames_under_fire(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints = joint_signals(ROOT / "rigs/encoders-plain.dbc", ["ENCODER1.Angle"], None)
    joints += joint_signals(ROOT / "rigs/encoders-cia406.dbc", ["TPDO2_1.Position"], None)
    for _ in range(count):
        data = rng.integers(0, 256, rng.integers(0, 9), dtype=np.uint8).tobytes()
        mapping = [mapped_object(int(word)) for word in rng.integers(0, 1 << 32, rng.integers(0, 5))]
        mapping[0:0] = [mapped_object(0x6503 << 16 | int(rng.integers(0, 64)))] if rng.random() < 0.5 else []
        mapping.append(mapped_object(0x6004 << 16 | 32))
        number = mapped_number(mapping, 0x6004)
        assert number is not None
        found = number.read(data)
        assert found is None or 0 <= found < 1 << 32
        assert (emergency(0.0, 1, data) is None) == (len(data) != 8)
        assert heartbeat_state(data) is None or len(data) == 1
        for joint in joints:
            counts = joint.counts(data)
            assert counts is None or -(1 << 31) <= counts < 1 << 31


def test_frames_of_any_data_give_a_value_or_none():
    frames_under_fire(20_000, seed=13)


@pytest.mark.endure
def test_a_million_frames_of_any_data():
    frames_under_fire(1_000_000, seed=14)
