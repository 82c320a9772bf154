"""RTDE's codec on mutated streams. TCP damages nothing on the way, and RTDE has nothing to find the next frame by.

So what is damaged inside a frame costs that frame; what is damaged in a length ends the stream, at once, as `Junk`, and
who reads it connects anew. Other codecs: tests/drivers/test_codecs_under_fire.py.
"""

import struct
import tracemalloc

import numpy as np
import pytest

from drivers.ur.rtde_codec import (
    ControllerVersion,
    Data,
    OutputsAnswer,
    PauseAnswer,
    ProtocolAnswer,
    RtdeCodec,
    RtdeJunk,
    StartAnswer,
    TextMessage,
    Unknown,
)
from tests.mutated import mutated

DECLARED = (
    ControllerVersion, Data, RtdeJunk, OutputsAnswer, PauseAnswer, ProtocolAnswer, StartAnswer, TextMessage, Unknown
)  # fmt: skip
NAMES, TYPES = ("timestamp", "actual_q", "robot_mode", "flag"), ("DOUBLE", "VECTOR6D", "INT32", "BOOL")
MOST_KEPT = 65535  # one frame


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def package(number: int) -> bytes:
    return frame("U", struct.pack(">Bd6di?", 1, 0.002 * number, *range(6), 7, True))


GOOD = (
    frame("V", b"\1"),
    frame("v", struct.pack(">4I", 5, 12, 0, 1101)),
    frame("O", b"\1DOUBLE,VECTOR6D,INT32,BOOL"),
    frame("S", b"\1"),
    frame("M", b"\5hello\3you\2"),
    package(0),
    package(1) + package(2),
    frame("P", b"\1"),
)
PROBE, PROBE_S = package(500), 1.0


def negotiated() -> RtdeCodec:
    codec = RtdeCodec()
    codec.expect(1, NAMES, TYPES)
    return codec


def stamps(messages: list) -> list[float]:
    return [stamp for m in messages if isinstance(m, Data) for stamp in m.packages["timestamp"].tolist()]


def under_fire(count: int, seed: int) -> int:
    """How often the stream had to be given up."""
    rng = np.random.default_rng(seed)
    codec, ended = negotiated(), 0
    for _ in range(count):
        data = mutated(rng, GOOD)
        cut = int(rng.integers(0, len(data) + 1))
        messages = codec.feed(data[:cut]) + codec.feed(data[cut:])
        assert all(isinstance(message, DECLARED) for message in messages), data.hex()
        assert len(codec._pending) <= MOST_KEPT, data.hex()
        if any(isinstance(message, RtdeJunk) for message in messages):
            assert codec.feed(PROBE) == [], data.hex()
            codec, ended = negotiated(), ended + 1
            assert stamps(codec.feed(PROBE)) == [PROBE_S]
    return ended


def test_mutated_input_gives_declared_messages_or_the_end_of_the_stream() -> None:
    assert under_fire(20_000, seed=15) > 1000


@pytest.mark.endure
def test_a_million_mutated_inputs() -> None:
    assert under_fire(1_000_000, seed=16) > 50_000


def test_damage_inside_a_frame_costs_that_frame_only() -> None:
    rng = np.random.default_rng(17)
    for _ in range(5000):
        hurt = bytearray(GOOD[rng.integers(len(GOOD))])
        if len(hurt) > 4:  # the recipe's number is a part of the framing of data
            hurt[int(rng.integers(4, min(len(hurt), 4 + 60)))] = int(rng.integers(256))
        assert stamps(negotiated().feed(bytes(hurt) + PROBE))[-1:] == [PROBE_S], hurt.hex()


@pytest.mark.parametrize("size", [0, 2, 4, 68, 70, 65535])
def test_a_package_of_another_size_than_its_recipe_ends_the_stream_at_once(size: int) -> None:
    codec = negotiated()
    (found,) = codec.feed(struct.pack(">H", size) + package(0)[2:8])
    assert found == RtdeJunk(0, struct.pack(">H", size) + package(0)[2:8])
    assert codec.feed(PROBE) == []


@pytest.mark.parametrize("kind", "VvMSP")
def test_a_length_that_an_answer_cannot_have_ends_the_stream_at_once(kind: str) -> None:
    assert isinstance(negotiated().feed(struct.pack(">HB", 65535, ord(kind)))[0], RtdeJunk)


def test_no_length_field_reserves_memory() -> None:
    inputs = [good[:at] + b"\xff\xff\xff\xff" + good[at + 4 :] for good in GOOD for at in range(len(good))]
    codec = negotiated()
    tracemalloc.start()
    try:
        for data in inputs:
            if any(isinstance(message, RtdeJunk) for message in codec.feed(data)):
                codec = negotiated()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 4 * MOST_KEPT
