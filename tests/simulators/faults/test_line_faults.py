"""What every fault does to the bytes of a line, cycle by cycle."""

import pytest

from simulators.faults.device_faults import LINE_FAULTS, FaultError, Target
from simulators.faults.injector import FaultyWire, Injector
from simulators.wire import TICK_S


class Counter:
    """Answers a request with itself in brackets, and sends a new letter each cycle once it was asked to."""

    def __init__(self) -> None:
        self.sent = 0
        self.streams = False
        self.asked: list[bytes] = []

    def handle(self, data: bytes) -> bytes:
        self.asked.append(data)
        return b"[" + data + b"]"

    def due(self) -> bytes:
        if not self.streams:
            return b""
        self.sent += 1
        return b"<%d>" % self.sent

    def refusal(self, request: bytes) -> bytes | None:
        return b"no" if request.startswith(b"?") else None


class Line:
    def __init__(self) -> None:
        self.device = Counter()
        self.faults = Injector("counter", Target())
        self.wire = FaultyWire(self.device, self.faults, "line")

    def inject(self, kind: str, count: int | None = None, every: int = 1, port: str | None = None, **settings) -> None:
        self.faults.inject(kind, count, every, port, settings)

    def cycles(self, count: int) -> list[bytes]:
        return [self.wire.due() for _ in range(count)]


@pytest.fixture
def line() -> Line:
    line = Line()
    line.device.streams = True
    return line


def test_without_a_fault_everything_passes_as_it_is(line) -> None:
    assert line.wire.handle(b"hello") == b"[hello]"
    assert line.cycles(3) == [b"<1>", b"<2>", b"<3>"]


def test_bursts_come_together_and_nothing_is_lost(line) -> None:
    line.inject("bursts", seconds=4 * TICK_S)
    assert line.cycles(8) == [b"", b"", b"", b"<1><2><3><4>", b"", b"", b"", b"<5><6><7><8>"]


def test_a_fault_clears_itself_after_its_count(line) -> None:
    line.inject("silence", count=2)
    assert line.cycles(4) == [b"", b"", b"<3>", b"<4>"]
    assert line.faults.listed() == []


def test_a_fault_without_a_count_lasts_until_it_is_cleared(line) -> None:
    line.inject("silence")
    assert line.cycles(50) == [b""] * 50
    assert line.faults.listed() == [{"device": "counter", "kind": "silence", "struck": 50, "left": None}]
    line.faults.clear()
    assert line.cycles(1) == [b"<51>"]


def test_every_third_output_only(line) -> None:
    line.inject("duplicate", every=3)
    assert line.cycles(6) == [b"<1>", b"<2>", b"<3><3>", b"<4>", b"<5>", b"<6><6>"]


def test_only_the_named_port(line) -> None:
    line.inject("silence", port="another")
    assert line.cycles(1) == [b"<1>"]


def test_delay_keeps_the_order(line) -> None:
    line.inject("delay", count=1, seconds=3 * TICK_S)
    assert line.cycles(6) == [b"", b"", b"", b"<1><2><3><4>", b"<5>", b"<6>"]


def test_split_sends_the_rest_later_and_in_order(line) -> None:
    line.inject("split", count=1, seconds=TICK_S)
    first, second, third = line.cycles(3)
    assert first + second == b"<1><2>"
    assert 0 < len(first) < 3
    assert third == b"<3>"


def test_junk_comes_before_the_output(line) -> None:
    line.inject("junk", count=1, bytes=7)
    ((junk),) = line.cycles(1)
    assert junk.endswith(b"<1>")
    assert len(junk) == 10


def test_a_wrong_checksum_turns_one_bit(line) -> None:
    line.inject("checksum", count=1)
    (spoilt,) = line.cycles(1)
    different = [a ^ b for a, b in zip(spoilt, b"<1>", strict=True)]
    assert sum(byte.bit_count() for byte in different) == 1


def test_an_error_reply_keeps_the_request_from_the_device(line) -> None:
    line.inject("error", count=1)
    assert line.wire.handle(b"hello") == b"[hello]"  # nothing that could be refused
    assert line.wire.handle(b"?why") == b"no"
    assert line.wire.handle(b"?why") == b"[?why]"
    assert line.device.asked == [b"hello", b"?why"]


def test_only_every_nth_output_comes(line) -> None:
    line.inject("nth-only", n=3)
    assert line.cycles(6) == [b"", b"", b"<3>", b"", b"", b"<6>"]


def test_a_stale_device_repeats_what_it_sent_last(line) -> None:
    line.cycles(2)
    line.inject("stale", count=3)
    assert line.cycles(4) == [b"<2>", b"<2>", b"<2>", b"<6>"]


def test_a_disconnected_line_is_away_for_a_while(line) -> None:
    line.inject("disconnect", count=1)
    assert line.cycles(1) == [b""]
    assert line.wire.closing
    line.cycles(60)
    assert not line.wire.closing


@pytest.mark.parametrize("kind", [kind.name for kind in LINE_FAULTS])
def test_no_fault_does_anything_while_nothing_is_sent(kind) -> None:
    line = Line()
    line.inject(kind, count=1)
    assert line.cycles(5) == [b""] * 5
    assert line.faults.listed()[0]["struck"] == 0


@pytest.mark.parametrize(
    ("kind", "settings", "says"),
    [
        ("explode", {}, "no fault 'explode'; there are delay"),
        ("delay", {"minutes": 1}, "no setting 'minutes'; there are seconds"),
        ("delay", {"seconds": "long"}, "give a number from"),
        ("delay", {"seconds": float("nan")}, "give a number from"),
        ("junk", {"bytes": 1e9}, "give a number from 1 to 65536"),
        ("silence", {"n": 1}, "there are none"),
        ("clock", {}, "puts no time stamps"),
        ("saturation", {}, "sees no light"),
    ],
)
def test_what_cannot_be_injected_is_refused(line, kind, settings, says) -> None:
    with pytest.raises(FaultError, match=says):
        line.inject(kind, **settings)
    assert line.faults.listed() == []


def test_counts_must_make_sense(line) -> None:
    with pytest.raises(FaultError, match="count 0"):
        line.inject("silence", count=0)
