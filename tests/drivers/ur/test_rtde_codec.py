import itertools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.ur.rtde_codec import (
    ControllerVersion,
    Data,
    Message,
    OutputsAnswer,
    PauseAnswer,
    ProtocolAnswer,
    RtdeCodec,
    RtdeJunk,
    StartAnswer,
    TextMessage,
    Unknown,
    encode_outputs_request,
    encode_protocol_request,
    encode_start,
    encode_version_request,
)

NAMES, TYPES = ("timestamp", "actual_q", "robot_mode", "flag"), ("DOUBLE", "VECTOR6D", "INT32", "BOOL")


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def package(number: int, recipe_id: int = 1) -> bytes:
    return frame("U", struct.pack(">Bd6di?", recipe_id, 0.002 * number, *range(6), 7, number % 2))


STREAM = (
    bytes.fromhex("00045601")
    + bytes.fromhex("001376 00000005 0000000c 00000000 0000044d")
    + frame("O", b"\x01DOUBLE,VECTOR6D,INT32,BOOL")
    + frame("S", b"\x01")
    + b"".join(package(number) for number in range(3))
    + frame("M", b"\x05hello\x03you\x02")
    + b"".join(package(number) for number in range(3, 7))
    + frame("P", b"\x01")
)


def decode(chunks: list[bytes]) -> tuple[list[Message], np.ndarray]:
    """Messages other than data, and the times of all data packages."""
    codec, others, times = RtdeCodec(), [], []
    codec.expect(1, NAMES, TYPES)
    for message in itertools.chain.from_iterable(codec.feed(chunk) for chunk in chunks):
        if isinstance(message, Data):
            times.extend(message.packages["timestamp"])
        else:
            others.append(message)
    return others, np.array(times)


def test_requests_are_the_bytes_of_the_guide() -> None:
    assert encode_protocol_request() == bytes.fromhex("0005560002")
    assert encode_version_request() == bytes.fromhex("000376")
    assert encode_start() == bytes.fromhex("000353")
    assert encode_outputs_request(125.0, ["timestamp", "actual_q"]) == bytes.fromhex("001d4f405f400000000000") + (
        b"timestamp,actual_q"
    )


def test_a_whole_conversation() -> None:
    others, times = decode([STREAM])
    assert others == [
        ProtocolAnswer(True),
        ControllerVersion(5, 12, 0, 1101),
        OutputsAnswer(1, TYPES),
        StartAnswer(True),
        TextMessage(2, "hello", "you"),
        PauseAnswer(True),
    ]
    assert times == pytest.approx(0.002 * np.arange(7))


def test_values_have_the_types_of_the_recipe() -> None:
    codec = RtdeCodec()
    codec.expect(1, NAMES, TYPES)
    (data,) = codec.feed(package(3))
    assert isinstance(data, Data)
    assert data.packages["actual_q"].tolist() == [[0, 1, 2, 3, 4, 5]]
    assert data.packages["robot_mode"].tolist() == [7]
    assert data.packages["flag"].tolist() == [True]


@given(st.lists(st.integers(0, len(STREAM)), max_size=20))
def test_any_split_gives_the_same(cuts: list[int]) -> None:
    edges = [0, *sorted(cuts), len(STREAM)]
    others, times = decode([STREAM[a:b] for a, b in itertools.pairwise(edges)])
    expected, expected_times = decode([STREAM])
    assert others == expected
    assert np.array_equal(times, expected_times)


def test_packages_of_another_recipe_are_not_mixed_in() -> None:
    others, times = decode([package(0) + package(1, recipe_id=2) + package(2)])
    assert times == pytest.approx([0.0, 0.004])
    assert [type(message) for message in others] == [Unknown]


@pytest.mark.parametrize("rubbish", [b"\x00\x00U", b"\x00\x02U", b"Connected: Universal Robots"])
def test_what_is_no_frame_is_junk_with_its_place_and_nothing_follows(rubbish: bytes) -> None:
    codec = RtdeCodec()
    assert codec.feed(frame("S", b"\x01")) == [StartAnswer(True)]
    assert codec.feed(rubbish + b"more") == [RtdeJunk(4, (rubbish + b"more")[:32])]
    assert codec.feed(frame("S", b"\x01")) == []


@given(at=st.integers(0, len(STREAM) - 1), value=st.integers(0, 255), cut=st.integers(0, len(STREAM)))
@settings(max_examples=300)
def test_a_damaged_byte_raises_nothing_and_invents_no_package(at: int, value: int, cut: int) -> None:
    damaged = STREAM[:at] + bytes([value]) + STREAM[at + 1 :]
    _, times = decode([damaged[:cut], damaged[cut:]])
    assert len(times) <= 7


@given(st.binary(max_size=400))
def test_any_bytes_are_messages_or_junk(data: bytes) -> None:
    decode([data])


@pytest.mark.parametrize("payload", [b"", b"\x05hi", b"\x02hi\x09you\x01", b"\x02hi\x03you\x01more"])
def test_a_text_that_does_not_fit_its_lengths_is_unknown(payload: bytes) -> None:
    assert RtdeCodec().feed(frame("M", payload)) == [Unknown(ord("M"), payload)]
