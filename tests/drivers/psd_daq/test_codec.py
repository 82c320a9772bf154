"""The DAQ codec against the documented bytes, split, damaged and surrounded by junk."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.psd_daq.codec import MAX_FRAME, PsdDaqCodec, frame
from drivers.psd_daq.messages import (
    Ack,
    BadFrame,
    Flag,
    Identify,
    Identity,
    Message,
    MessageType,
    Nak,
    Refusal,
    Samples,
    StartStream,
    StopStream,
)
from drivers.psd_faces import FaceKind

DOCUMENT = Path(__file__).parents[3] / "docs/protocols/psd-daq.md"


def documented() -> dict[str, bytes]:
    block = DOCUMENT.read_text().split("```frames\n")[1].split("```")[0]
    rows = [re.fullmatch(r"(.+?)  +((?:[0-9a-f]{2} ?)+)", line) for line in block.splitlines()]
    return {row[1]: bytes.fromhex(row[2]) for row in rows if row is not None}


FRAMES = documented()
ANSWERS = ("IDENTITY", "ACK START_STREAM", "NAK START_STREAM", "DATA")


def kinds(messages: list[Message]) -> list[type]:
    return [type(message) for message in messages]


def test_every_message_has_an_example():
    assert len(FRAMES) == 8


@pytest.mark.parametrize(
    ("example", "request_"),
    [
        ("IDENTIFY", Identify()),
        ("START_STREAM 1000", StartStream(1000)),
        ("STOP_STREAM", StopStream()),
    ],
)
def test_requests_are_the_documented_bytes(example, request_):
    assert PsdDaqCodec().encode(request_) == FRAMES[example]


def test_identity_as_documented():
    (identity,) = PsdDaqCodec().feed(FRAMES["IDENTITY"])
    assert isinstance(identity, Identity)
    assert (identity.firmware, identity.serial_number, identity.model) == ("1.0.0", "CB-0001", "emulated dual PSD")
    assert identity.full_scale_a == pytest.approx(500e-6)
    assert identity.transimpedance_v_a == 20_000
    assert [(face.kind, face.length_m) for face in identity.faces] == [(FaceKind.DUO_LATERAL, pytest.approx(0.02))] * 2
    assert (identity.min_rate_hz, identity.max_rate_hz) == (100, 4000)


def test_answers_as_documented():
    codec = PsdDaqCodec()
    assert codec.feed(FRAMES["ACK START_STREAM"]) == [Ack(MessageType.START_STREAM)]
    (nak,) = codec.feed(FRAMES["NAK START_STREAM"])
    assert nak == Nak(2, Refusal.RATE_OUT_OF_RANGE, "5000 Hz; 100 to 4000 Hz are possible")


def test_data_as_documented():
    (samples,) = PsdDaqCodec().feed(FRAMES["DATA"])
    assert isinstance(samples, Samples)
    assert (samples.sequence, samples.time_us, samples.period_ns) == (2**32 - 1, 1_500_000, 1_000_000)
    assert samples.temperature_degC == pytest.approx(24.5)
    expected = [90_000_000, 110_000_000, 100_000_000, 100_000_000, 0, -2000, 1500, 500]
    np.testing.assert_array_equal(samples.photocurrent_pa, [expected])
    assert samples.flags.tolist() == [Flag.PSD2_NO_LIGHT]


@pytest.mark.parametrize("name", ANSWERS)
def test_every_split_gives_the_same_message(name):
    data = FRAMES[name]
    whole = repr(PsdDaqCodec().feed(data))
    for cut in range(len(data) + 1):
        codec = PsdDaqCodec()
        assert repr(codec.feed(data[:cut]) + codec.feed(data[cut:])) == whole
    codec = PsdDaqCodec()
    assert repr([message for byte in data for message in codec.feed(bytes((byte,)))]) == whole


def test_all_answers_in_one_piece():
    stream = b"".join(FRAMES[name] for name in ANSWERS)
    assert kinds(PsdDaqCodec().feed(stream)) == [Identity, Ack, Nak, Samples]


@given(st.binary(max_size=300))
def test_one_good_frame_after_any_junk_is_read(junk):
    """Junk may swallow the first delimiter, so it gets one of its own, as on the wire between two frames."""
    messages = PsdDaqCodec().feed(junk + b"\0" + FRAMES["ACK START_STREAM"])
    assert messages[-1] == Ack(2)
    assert all(isinstance(message, BadFrame) for message in messages[:-1])


@settings(max_examples=300)
@given(st.sampled_from(ANSWERS), st.data())
def test_a_damaged_frame_never_gives_wrong_content(name, data):
    """CRC-16 finds every burst of up to 16 bits; the frame behind the damage is read again."""
    sent = bytearray(FRAMES[name])
    at = data.draw(st.integers(0, len(sent) - 2))
    sent[at] ^= data.draw(st.integers(1, 255))
    codec = PsdDaqCodec()
    messages = codec.feed(bytes(sent) + b"\0" + FRAMES["ACK START_STREAM"])
    assert messages[-1] == Ack(2)
    assert all(isinstance(message, BadFrame) for message in messages[:-1])


def test_bad_frame_says_where_and_why():
    good = FRAMES["ACK START_STREAM"]
    damaged = bytes((*good[:4], good[4] ^ 1, *good[5:]))
    _, bad = PsdDaqCodec().feed(good + damaged)
    assert isinstance(bad, BadFrame)
    assert bad.offset == len(good)
    assert "CRC 0x" in bad.reason
    assert bad.first == damaged[:-1]


def test_an_endless_run_is_dropped_without_filling_memory():
    codec = PsdDaqCodec()
    found = [message for _ in range(1000) for message in codec.feed(b"\x55" * 100)]
    assert kinds(found) == [BadFrame]
    assert len(codec._buffer) <= MAX_FRAME
    assert codec.feed(b"\0" + FRAMES["ACK START_STREAM"]) == [Ack(2)]


@pytest.mark.parametrize(
    ("encoded", "reason"),
    [
        (frame(MessageType.ACK, b"\x01", version=2), "protocol version 2, expected 1"),
        (frame(0x77), "message type 0x77"),
        (frame(MessageType.ACK, b"\x01\x02"), "body of 2 bytes, expected 1"),
        (frame(MessageType.NAK, b"\x01\x02\xffabc"), "runs over the end"),
        (frame(MessageType.DATA, b"\0" * 16 + b"\xff\0\0"), "255 samples"),
        (frame(MessageType.DATA, b"\0" * 19), "0 samples"),
        (frame(MessageType.IDENTITY, b"\x01"), "message type 0x81"),
        (frame(MessageType.ACK), "body of 0 bytes"),
        (b"\x05\x01\x00", "not enough input bytes"),
        (b"\x02\x01\x00", "frame of 1 bytes"),
    ],
)
def test_a_frame_that_fits_no_layout_is_refused(encoded, reason):
    (bad,) = PsdDaqCodec().feed(encoded)
    assert isinstance(bad, BadFrame)
    assert reason in bad.reason


def test_a_rate_that_does_not_fit_its_field():
    with pytest.raises(ValueError, match="70000 Hz"):
        PsdDaqCodec().encode(StartStream(70_000))
