"""The PSD driver against the emulated box on a real pseudo-terminal, and against lines in memory."""

import os
import tty
from collections.abc import Callable

import numpy as np
import pytest

from drivers.device import Block
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.psd_daq.codec import DATA_HEAD, SAMPLE, frame
from drivers.psd_daq.device import BAUD, PsdDaq
from drivers.psd_daq.messages import Flag, MessageType
from drivers.transports.serial_port import SerialAddress, open_serial

READ_S = 2.0


def daq_at(port: str, rate_hz: float = 1000.0) -> PsdDaq:
    return PsdDaq(lambda: open_serial(SerialAddress(port=port), BAUD), rate_hz)


class JumpingClock:
    """Time passes only while somebody waits."""

    def __init__(self) -> None:
        self.t_s = 100.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_s(self, seconds: float) -> None:
        self.t_s += seconds


class MemoryLine:
    """A line whose far end is a function from what was written to what comes back."""

    name = "memory"

    def __init__(self, clock: JumpingClock, answer: Callable[[bytes], bytes]) -> None:
        self._clock, self._answer = clock, answer
        self._waiting = b""
        self.closed = False

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        if not self._waiting:
            self._clock.sleep_s(timeout_s)
        data, self._waiting = self._waiting[:max_bytes], self._waiting[max_bytes:]
        return data

    def write(self, data: bytes, timeout_s: float) -> None:
        self._waiting += self._answer(data)

    def close(self) -> None:
        self.closed = True


def in_memory(answer: Callable[[bytes], bytes]) -> tuple[PsdDaq, MemoryLine]:
    clock = JumpingClock()
    line = MemoryLine(clock, answer)
    return PsdDaq(lambda: line, clock=clock), line


# --- on the wire


def test_the_box_says_who_it_is(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    try:
        assert daq.identity is not None
        assert daq.identity.serial_number == "CB-0007"
        assert [face.length_m for face in daq.identity.faces] == [pytest.approx(0.02)] * 2
        assert daq.describe()[0].full_scale == pytest.approx(500e-6)
    finally:
        daq.close()


@pytest.mark.parametrize("rate_hz", [100.0, 1000.0, 4000.0])
def test_samples_come_without_gap_at_the_rate_asked_for(psd_box, rate_hz):
    daq = daq_at(psd_box.port, rate_hz)
    daq.connect()
    try:
        blocks = [daq.read(READ_S) for _ in range(6)]
    finally:
        daq.close()
    sequence = np.concatenate([block.sequence for block in blocks])
    device_s = np.concatenate([block.device_s for block in blocks])
    assert sequence[0] == 0
    assert (np.diff(sequence) == 1).all()
    np.testing.assert_allclose(np.diff(device_s), 1.0 / rate_hz, atol=1.1e-6)  # the box rounds to 1 us
    last = blocks[-1]
    np.testing.assert_allclose(last.values["photocurrent_a"][-1, :4], [90e-6, 110e-6, 100e-6, 100e-6], atol=1e-12)
    assert set(last.values["flags"]) == {Flag.PSD2_NO_LIGHT}
    np.testing.assert_allclose(last.values["temperature_degC"], 24.5)


def test_commands_while_streaming_lose_no_sample(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    try:
        blocks = [daq.read(READ_S)]
        for _ in range(3):
            assert daq.identify() == daq.identity
            blocks.append(daq.read(READ_S))
    finally:
        daq.close()
    assert (np.diff(np.concatenate([block.sequence for block in blocks])) == 1).all()


def test_a_damaged_frame_is_a_gap_and_the_stream_goes_on(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    try:
        before = daq.read(READ_S)
        psd_box.bench.verbs["psd.damage"](frames=1)
        sequence = before.sequence
        while (np.diff(sequence) == 1).all():
            sequence = np.concatenate([sequence, daq.read(READ_S).sequence])
        assert np.diff(sequence).max() == 11  # ten samples in a frame at 1 kHz
        assert daq.bad_frame_count == 1
    finally:
        daq.close()


def test_a_box_that_falls_silent_is_stale_and_comes_back_with_a_gap(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    try:
        before = daq.read(READ_S)
        psd_box.bench.verbs["psd.silence"](on=True)
        last, silence = read_until_silent(daq, before)
        assert "no sample within 0.1 s" in str(silence)
        psd_box.bench.verbs["psd.silence"](on=False)
        assert daq.read(READ_S).sequence[0] > last.sequence[-1] + 1
    finally:
        daq.close()


def read_until_silent(daq: PsdDaq, last: Block) -> tuple[Block, DeviceStale]:
    """What was under way still comes; a hundred blocks would be more than a second of it."""
    for _ in range(100):
        try:
            last = daq.read(0.1)
        except DeviceStale as silence:
            return last, silence
    raise AssertionError("the box never fell silent")


def test_connecting_again_goes_on_counting(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    first = daq.read(READ_S)
    daq.connect()
    try:
        assert daq.read(READ_S).sequence[0] == first.sequence[-1] + 2
    finally:
        daq.close()


def test_a_silent_box_is_stale_when_connecting(psd_box):
    psd_box.bench.verbs["psd.silence"](on=True)
    with pytest.raises(DeviceStale, match=r"no answer to IDENTIFY within 1 s .* check power, cable"):
        daq_at(psd_box.port).connect()


def test_a_port_in_use_is_lost_and_named(psd_box):
    daq = daq_at(psd_box.port)
    daq.connect()
    try:
        with pytest.raises(DeviceLost, match=rf"{psd_box.port}: busy; another program"):
            daq_at(psd_box.port).connect()
    finally:
        daq.close()


def test_an_unplugged_box_is_lost():
    master, slave = os.openpty()
    tty.setraw(slave)
    line = open_serial(SerialAddress(port=os.ttyname(slave)), BAUD)
    os.close(slave)
    daq = PsdDaq(lambda: line)
    daq._line = line
    os.close(master)
    with pytest.raises(DeviceLost, match="gone while reading"):
        daq.read(1.0)
    daq.close()
    daq.close()


# --- other devices, other answers


def test_another_line_oriented_device_is_named():
    daq, line = in_memory(lambda data: b"\a" if b"\r" in data else b"")
    with pytest.raises(DeviceRefused, match=r"not a PSD box: it answers an empty line with 07 .*CAN adapter"):
        daq.connect()
    assert line.closed


def test_a_chattering_device_is_named_by_what_it_sent():
    daq, _ = in_memory(lambda data: b"$GPGGA,1234\r\n")
    with pytest.raises(DeviceRefused, match="it sent 24 47 50 47 47 41"):
        daq.connect()


def test_a_box_of_another_protocol_version_is_refused():
    daq, _ = in_memory(lambda data: frame(MessageType.IDENTITY, b"\0" * 30, version=3))
    with pytest.raises(DeviceRefused, match="protocol version 3, expected 1"):
        daq.connect()


def test_a_refusal_carries_code_and_text():
    def answer(data: bytes) -> bytes:
        if data[2] == MessageType.START_STREAM:
            return frame(MessageType.NAK, b"\x02\x63\x04warm")
        return documented_identity() if data[2] == MessageType.IDENTIFY else b""

    daq, line = in_memory(answer)
    with pytest.raises(DeviceRefused, match="START_STREAM refused, code 99: warm"):
        daq.connect()
    assert line.closed


def test_a_rate_that_this_box_cannot_do_is_refused():
    daq, _ = in_memory(lambda data: documented_identity(max_rate_hz=500) if data[2] == MessageType.IDENTIFY else b"")
    with pytest.raises(DeviceRefused, match="samples at 100 to 500 Hz, not at rate_hz 1000"):
        daq.connect()


def documented_identity(max_rate_hz: int = 4000) -> bytes:
    face = b"\x01" + (20_000).to_bytes(4, "little")
    head = b"\x01\x00\x00" + (500_000_000).to_bytes(4, "little") + (20_000).to_bytes(4, "little")
    rates = (100).to_bytes(2, "little") + max_rate_hz.to_bytes(2, "little")
    return frame(MessageType.IDENTITY, head + face + face + rates + b"\x04CB-9" + b"\x03box")


def test_only_damaged_frames_are_a_wire_error():
    def answer(data: bytes) -> bytes:
        if data[2] == MessageType.START_STREAM:
            return frame(MessageType.ACK, b"\x02") + b"\x09\x09\x09\x00"
        return documented_identity() if data[2] == MessageType.IDENTIFY else b""

    daq, _ = in_memory(answer)
    daq.connect()
    daq._line._waiting += b"\x07\x07\x07\x00"
    with pytest.raises(WireError, match=r"1 damaged frames .* 07 07 07"):
        daq.read(1.0)


def test_what_waits_when_this_program_comes_late_is_no_silence():
    """The time is over before the first look at the line."""

    def answer(data: bytes) -> bytes:
        if data[2] == MessageType.START_STREAM:
            return frame(MessageType.ACK, b"\x02")
        return documented_identity() if data[2] == MessageType.IDENTIFY else b""

    daq, line = in_memory(answer)
    daq.connect()
    line._waiting += frame(MessageType.DATA, DATA_HEAD.pack(7, 1_000_000, 1_000_000, 1, 2500) + bytes(SAMPLE.itemsize))
    assert daq.read(0.0).device_s == pytest.approx([1.0])
    with pytest.raises(DeviceStale, match="no sample within 0 s"):
        daq.read(0.0)


@pytest.mark.parametrize("rate_hz", [99.0, 4001.0, 1000.5, float("nan")])
def test_a_rate_outside_the_protocol_is_refused_early(rate_hz):
    with pytest.raises(ValueError, match="whole hertz from 100 to 4000"):
        PsdDaq(lambda: MemoryLine(JumpingClock(), bytes), rate_hz)


def test_reading_before_connecting_says_so():
    with pytest.raises(DeviceLost, match="call connect"):
        in_memory(bytes)[0].read(0.1)
