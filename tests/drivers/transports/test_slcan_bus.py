"""The serial-line adapter that reads all that waits: the frames of python-can's own, however the bytes are split."""

import itertools
import math
import os
import tty
from collections.abc import Iterator
from contextlib import suppress

import can
import pytest

from acquisition.recording.can_log import frame_of
from drivers.transports.slcan_bus import LONGEST_LINE, BlockSlcanBus

LINES = (
    b"t28140A0B0C0D\r"  # four bytes
    b"z\r"  # an acknowledgement
    b"t0800\r"  # no data
    b"T1ABCDEF82FF00\r"  # 29 bits
    b"r1234\r"  # remote
    b"d1239" + b"AB" * 12 + b"\r"  # CAN FD, 12 bytes
    b"t7FF80102030405060708\r"
)  # fmt: skip
FRAMES = [
    (0x281, False, bytes.fromhex("0A0B0C0D")),
    (0x080, False, b""),
    (0x1ABCDEF8, True, bytes.fromhex("FF00")),
    (0x123, False, b""),
    (0x123, False, b"\xab" * 12),
    (0x7FF, False, bytes(range(1, 9))),
]


class Adapter:
    """The far end of a pseudo-terminal, on which the bus is opened."""

    def __init__(self) -> None:
        self._far, near = os.openpty()
        tty.setraw(near)
        self.bus = BlockSlcanBus(os.ttyname(near), bitrate=1_000_000, sleep_after_open=0.0)
        os.close(near)

    def says(self, data: bytes) -> None:
        os.write(self._far, data)

    def hears(self) -> bytes:
        """A piece: a pseudo-terminal hands on what was written in any pieces."""
        return os.read(self._far, 4096)

    def hears_until(self, end: bytes) -> bytes:
        said = b""
        while not said.endswith(end):
            said += self.hears()
        return said

    def is_unplugged(self) -> None:
        os.close(self._far)
        self._far = -1

    def close(self) -> None:
        with suppress(can.CanError, OSError):
            self.bus.shutdown()
        self.bus.serialPortOrig.close()
        if self._far >= 0:
            os.close(self._far)


@pytest.fixture
def adapter() -> Iterator[Adapter]:
    made = Adapter()
    yield made
    made.close()


def heard(bus: can.BusABC, count: int) -> list[tuple[int, bool, bytes]]:
    found = [bus.recv(2.0) for _ in range(count)]
    return [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in found if m is not None]


def test_all_kinds_of_frames_are_reported_in_order(adapter: Adapter) -> None:
    adapter.says(LINES)
    assert heard(adapter.bus, len(FRAMES)) == FRAMES
    assert adapter.bus.recv(0.0) is None


def test_frames_carry_no_stamp_for_the_adapter_gives_none(adapter: Adapter) -> None:
    adapter.says(LINES)
    messages = [adapter.bus.recv(2.0) for _ in FRAMES]
    assert all(message is not None and math.isnan(frame_of(message, 7.0, sent=False).device_s) for message in messages)


def test_frames_of_an_adapter_that_still_stamps_are_read_without_the_stamp(adapter: Adapter) -> None:
    adapter.says(b"t28140A0B0C0D0102\rT1ABCDEF82FF000103\rt08000104\r")
    messages = [message for _ in range(3) if (message := adapter.bus.recv(2.0)) is not None]
    frames = [FRAMES[0], FRAMES[2], FRAMES[1]]
    assert [(m.arbitration_id, m.is_extended_id, bytes(m.data)) for m in messages] == frames
    assert all(math.isnan(frame_of(message, 7.0, sent=False).device_s) for message in messages)


@pytest.mark.parametrize("at", range(1, len(LINES), 5))
def test_a_line_may_come_in_two_pieces(adapter: Adapter, at: int) -> None:
    adapter.says(LINES[:at])
    whole = LINES[:at].count(b"\r") - LINES[:at].count(b"z\r")
    before = heard(adapter.bus, whole)
    assert adapter.bus.recv(0.0) is None
    adapter.says(LINES[at:])
    assert before + heard(adapter.bus, len(FRAMES) - whole) == FRAMES


@pytest.mark.parametrize("digits", [b"xyz", b"0102030x", b"+1020304"])
def test_a_line_that_makes_no_sense_is_refused_as_python_can_does_and_the_next_is_read(
    adapter: Adapter, digits: bytes
) -> None:
    adapter.says(b"t2814" + digits + b"\rt0800\r")
    with pytest.raises(ValueError, match="hexadecimal"):
        adapter.bus.recv(2.0)
    assert heard(adapter.bus, 1) == [(0x080, False, b"")]


def test_junk_without_an_end_does_not_fill_the_memory(adapter: Adapter) -> None:
    for _ in range(10):
        adapter.says(b"?" * 1000)
        assert adapter.bus.recv(0.0) is None
    assert len(adapter.bus._begun) <= LONGEST_LINE
    adapter.says(b"\rt0800\r")
    assert heard(adapter.bus, 1) == [(0x080, False, b"")]


def test_filters_are_kept(adapter: Adapter) -> None:
    adapter.bus.set_filters([{"can_id": 0x7FF, "can_mask": 0x7FF, "extended": False}])
    adapter.says(LINES)
    assert heard(adapter.bus, 1) == [FRAMES[-1]]


def test_an_unplugged_adapter_raises_what_python_can_raises(adapter: Adapter) -> None:
    adapter.is_unplugged()
    with pytest.raises(can.CanOperationError):
        adapter.bus.recv(2.0)


def test_frames_are_sent_as_lines(adapter: Adapter) -> None:
    adapter.hears_until(b"O\rO\r")  # how the adapter was opened
    adapter.bus.send(can.Message(arbitration_id=0x601, data=b"\x40\x00", is_extended_id=False))
    assert adapter.hears_until(b"\r") == b"t60124000\r"


def send_while_it_takes(bus: can.BusABC, message: can.Message, sent: Iterator[int]) -> None:
    """Counts the whole frames."""
    while True:
        bus.send(message, 0.05)
        assert next(sent) < 10_000


def test_an_adapter_that_takes_nothing_more_is_reported_in_time_and_no_frame_is_torn(adapter: Adapter) -> None:
    adapter.hears_until(b"O\rO\r")  # how the adapter was opened
    message, sent = can.Message(arbitration_id=0x281, data=bytes(8), is_extended_id=False), itertools.count()
    with pytest.raises(can.CanOperationError, match="Could not write"):
        send_while_it_takes(adapter.bus, message, sent)
    taken, whole = b"", next(sent)
    while taken.count(b"\r") < whole:
        taken += adapter.hears()
    assert taken.startswith(whole * b"t28180000000000000000\r")


def test_all_plain_frames_that_wait_come_at_once_and_a_rarer_one_by_itself(adapter: Adapter) -> None:
    adapter.says(LINES)
    found: list[list[int]] = []
    while sum(map(len, found)) < len(FRAMES):
        found.append([message.arbitration_id for message in adapter.bus.recv_all(2.0)])
    assert found == [[0x281, 0x080], [0x1ABCDEF8], [0x123], [0x123], [0x7FF]]
    assert adapter.bus.recv_all(0.0) == []


def test_a_damaged_line_costs_no_frame_before_or_after_it(adapter: Adapter) -> None:
    adapter.says(b"t0800\rt28140A0B\rt0810\r")
    assert [message.arbitration_id for message in adapter.bus.recv_all(2.0)] == [0x080]
    with suppress(ValueError, IndexError):
        adapter.bus.recv_all(0.0)
    assert [message.arbitration_id for message in adapter.bus.recv_all(0.0)] == [0x081]


def test_an_adapter_that_has_gone_is_no_silence_to_one_who_does_not_wait(adapter: Adapter) -> None:
    adapter.is_unplugged()
    with pytest.raises(can.CanError):
        adapter.bus.recv_all(0.0)
