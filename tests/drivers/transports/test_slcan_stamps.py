"""A serial adapter that stamps frames itself: asked for it, read in bursts, over the minute, and refused."""

from collections.abc import Iterator

import pytest

from drivers.errors import DeviceError, DeviceRefused, DeviceStale
from drivers.transports import slcan_stamps
from drivers.transports.can_bus import bus_opener, opened
from drivers.transports.slcan_stamps import MinuteClock, StampedSlcanBus
from tests.drivers.transports.stamping_adapter import StampingAdapter


@pytest.fixture
def adapter() -> Iterator[StampingAdapter]:
    made = StampingAdapter()
    yield made
    made.close()


@pytest.fixture
def bus(adapter: StampingAdapter) -> Iterator[StampedSlcanBus]:
    made = adapter.open()
    yield made
    made.shutdown()


def test_all_kinds_of_frames_carry_the_time_of_the_adapter(adapter: StampingAdapter, bus: StampedSlcanBus) -> None:
    adapter.say(b"t2812A0B0EA5E\rt08000000\rT1ABCDEF81FF0001\rr12340002\rR1ABCDEF80000f\rz\rt7FF10207d0\r")
    came = [bus.recv(5.0) for _ in range(6)]
    found = [(m.arbitration_id, m.is_remote_frame, bytes(m.data), m.timestamp) for m in came if m is not None]
    first_s = found[0][-1]
    expected = [
        (0x281, False, b"\xa0\xb0", -0.002),
        (0x080, False, b"", 0.0),
        (0x1ABCDEF8, False, b"\xff", 0.001),
        (0x123, True, b"", 0.002),
        (0x1ABCDEF8, True, b"", 0.015),
        (0x7FF, False, b"\x02", 2.0),
    ]
    assert [kind[:3] for kind in found] == [kind[:3] for kind in expected]
    assert [kind[3] - first_s for kind in found] == pytest.approx([kind[3] + 0.002 for kind in expected], abs=1e-6)
    assert bus.recv(0.0) is None


def test_frames_that_are_filtered_out_do_not_shift_the_stamps(adapter: StampingAdapter, bus: StampedSlcanBus) -> None:
    bus.set_filters([{"can_id": 0x7FF, "can_mask": 0x7FF, "extended": False}])
    adapter.say(b"t28100010\rt7FF00020\rt28100030\rt7FF00040\r")
    messages = [message for _ in range(2) if (message := bus.recv(5.0)) is not None]
    assert [message.arbitration_id for message in messages] == [0x7FF, 0x7FF]
    assert messages[1].timestamp - messages[0].timestamp == pytest.approx(0.032)


@pytest.mark.parametrize(
    "line",
    [
        b"t28100",  # no stamp
        b"t28120102",  # data, and no stamp
        b"t281101020",  # half of one
        b"t2810EA60",  # 60 000 ms
        b"t28100x01",
        b"d28110001",  # CAN FD
    ],
)
def test_a_line_without_a_stamp_is_refused_and_the_next_is_read(
    adapter: StampingAdapter, bus: StampedSlcanBus, line: bytes
) -> None:
    adapter.say(line + b"\rt08000001\r")
    with pytest.raises(ValueError, match="no frame with a time stamp"):
        bus.recv(5.0)
    message = bus.recv(5.0)
    assert message is not None
    assert message.arbitration_id == 0x080


def test_the_adapter_stamps_until_it_is_left() -> None:
    adapter = StampingAdapter()
    adapter.open().shutdown()
    adapter.close()
    assert adapter.commands.startswith(b"C\rS8\r\rV\rZ1\rO\rO\r")
    assert adapter.commands.endswith(b"C\rZ0\rC\r")


def refusal_of(adapter: StampingAdapter) -> DeviceError:
    try:
        with pytest.raises(DeviceError) as refused:
            opened(bus_opener("slcan", adapter.channel, 1_000_000, stamped=True), "encoders")
    finally:
        adapter.close()
    return refused.value


def test_an_adapter_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(StampingAdapter, "_answer", lambda self: None)
    monkeypatch.setattr(slcan_stamps, "ANSWER_S", 0.01)
    adapter = StampingAdapter()
    error = refusal_of(adapter)
    assert isinstance(error, DeviceStale)
    assert str(error).startswith('stamp = "hardware" in [devices.encoders] of the rig file: the adapter at ')
    assert f"{adapter.channel} does not answer 'V' within 0.01 s. Check its port, or delete the key" in str(error)


def test_an_adapter_that_refuses_stamps_is_named() -> None:
    adapter = StampingAdapter(refused=b"Z1")
    error = refusal_of(adapter)
    assert isinstance(error, DeviceRefused)
    assert f"the adapter at {adapter.channel} refuses 'Z1': it has no time stamps. " in str(error)


def test_time_goes_on_over_the_minute_through_bursts_and_silences() -> None:
    clock = MinuteClock()
    first_s = clock.follow(0, 1000.0)
    assert first_s > 0.0  # which would be no stamp
    passed = [(59_998, 59.9), (2, 59.9), (1, 59.9), (102, 60.4), (30_102, 91.0), (30_105, 91.0), (30_100, 391.2)]
    times_s = [clock.follow(stamp_ms, 1000.0 + late_s) - first_s for stamp_ms, late_s in passed]
    assert times_s == pytest.approx([59.998, 60.002, 60.001, 60.102, 90.102, 90.105, 390.1], abs=1e-6)


def test_an_adapter_that_lost_its_power_does_not_turn_time_back() -> None:
    clock = MinuteClock()
    first_s = clock.follow(30_000, 1000.0)
    clock.opened()
    times_s = [clock.follow(stamp_ms, 1000.0 + late_s) - first_s for stamp_ms, late_s in ((0, 3.0), (500, 3.5))]
    assert times_s == pytest.approx([3.0, 3.5], abs=1e-3)


def test_time_goes_on_when_the_adapter_is_opened_again() -> None:
    adapter = StampingAdapter()
    open_bus = bus_opener("slcan", adapter.channel, 1_000_000, stamped=True)
    times_s: list[float] = []
    for line in (b"t08007530\r", b"t08007594\r"):
        bus = opened(open_bus, "encoders")
        assert bus.get_version(10.0) == (10, 13)  # all commands are taken
        adapter.say(line)
        message = bus.recv(5.0)
        assert message is not None
        times_s.append(message.timestamp)
        bus.shutdown()
    adapter.close()
    assert times_s[1] - times_s[0] == pytest.approx(0.1)
