"""A pair of KPA101 as one detector instrument: on lines in memory, and on real pseudo-terminals."""

import numpy as np
import pytest

from acquisition.wires.psd_view import PsdView, psd_window
from drivers.clock import SystemClock
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.psd_daq.messages import Flag
from drivers.psd_faces import Face, FaceKind
from drivers.psd_kpa101.pair import BAUD, Head, Kpa101Pair, Wiring, counts_of
from drivers.transports.serial_port import SerialAddress, SerialLine, open_serial

LENGTH_M = 0.01
COUNT_M = 0.5 * LENGTH_M * (10 / 32767) / 1.2  # of the darker face, whose sum is 1.2 V
READ_S = 2.0


def spots_m(psd: Kpa101Pair, block) -> np.ndarray:
    assert psd.identity is not None
    one, two = (Face(face.kind, face.length_m) for face in psd.identity.faces)
    return PsdView((one, two), psd.identity.transimpedance_v_a).each(psd_window([block]))


def test_spots_of_both_faces(in_memory):
    in_memory.psd.connect()
    block = in_memory.psd.read(1.0)
    expected = [in_memory.world.spots_m[0] + in_memory.world.spots_m[1]] * len(block.host_s)
    np.testing.assert_allclose(spots_m(in_memory.psd, block), expected, atol=COUNT_M)
    assert set(block.values["flags"]) == {0}


def test_who_they_are(in_memory):
    in_memory.psd.connect()
    identity = in_memory.psd.identity
    assert (identity.model, identity.serial_number, identity.firmware) == ("KPA101", "69250001, 69250002", "1.0.7")
    assert identity.transimpedance_v_a == 1e5


def test_samples_keep_their_deadlines(in_memory):
    in_memory.psd.connect()
    blocks = [in_memory.psd.read(1.0) for _ in range(25)]
    sequence = np.concatenate([block.sequence for block in blocks])
    np.testing.assert_array_equal(np.diff(sequence), 1)
    device_s = np.concatenate([block.device_s for block in blocks])
    np.testing.assert_allclose(np.diff(device_s), 0.005, atol=2e-4)
    trips_s = np.concatenate([block.values["round_trip_s"] for block in blocks])
    assert (trips_s > 18 * 10 / BAUD).all()  # the reply takes its time on the line
    assert (trips_s < 0.005).all()


def test_a_reply_that_is_lost_is_a_gap_and_later_ones_are_not_taken_for_it(in_memory):
    """The reply arrives after it was given up, while the spot has moved: it must not count as the next reading."""
    in_memory.psd.connect()
    in_memory.psd.read(1.0)
    late: list[bytes] = []

    def hold(data: bytes) -> bytes:
        late.append(data)
        return b""

    line = in_memory.lines[0]
    line.spoil = hold
    with pytest.raises(DeviceStale, match=r"no reading of both units within 0\.2 s"):
        in_memory.psd.read(0.2)
    line.spoil = lambda data: data
    line.waiting += b"".join(late)
    in_memory.world.spots_m[0] = (-3.0e-3, 0.0)
    block = in_memory.psd.read(1.0)
    np.testing.assert_allclose(spots_m(in_memory.psd, block)[:, 0], -3.0e-3, atol=COUNT_M)
    assert in_memory.psd.missed_replies > 0


def test_junk_between_messages_is_counted_and_reading_goes_on(in_memory):
    in_memory.psd.connect()
    in_memory.lines[1].spoil = lambda data: b"\x00junk" + data if data else b""
    block = in_memory.psd.read(1.0)
    assert len(block.sequence) == 4
    assert in_memory.psd.bad_frame_count >= 4


def test_a_line_with_nothing_but_junk_says_so(in_memory):
    in_memory.psd.connect()
    in_memory.lines[1].spoil = lambda data: bytes(len(data)) if data else b""
    with pytest.raises(WireError, match=r"bytes that are no message .*; the last at byte \d+: 00 00"):
        in_memory.psd.read(0.5)


def test_a_silent_unit_is_stale_and_named(in_memory):
    in_memory.bench.verbs["psd.silence"](unit=2)
    with pytest.raises(DeviceStale, match=r"psd unit 2: no answer to RequestInfo within 1 s .* check power and cable"):
        in_memory.psd.connect()
    assert all(line.closed for line in in_memory.lines)


def test_a_unit_that_falls_silent_comes_back(in_memory):
    in_memory.psd.connect()
    before = in_memory.psd.read(1.0)
    in_memory.bench.verbs["psd.silence"](unit=1)
    with pytest.raises(DeviceStale):
        in_memory.psd.read(0.3)
    in_memory.bench.verbs["psd.silence"](unit=1, on=False)
    assert in_memory.psd.read(1.0).sequence[0] > before.sequence[-1] + 1


def test_a_unit_that_is_unplugged_is_lost(in_memory):
    in_memory.psd.connect()
    in_memory.lines[0].lost = True
    with pytest.raises(DeviceLost):
        in_memory.psd.read(1.0)
    in_memory.psd.close()
    in_memory.psd.close()


def test_exchanged_units_are_refused(in_memory):
    one, two = in_memory.lines
    named = tuple(Head(FaceKind.PIN_CUSHION, LENGTH_M, serial_number=n) for n in ("69250002", "69250001"))
    with pytest.raises(DeviceRefused, match="unit 1 is 69250001, the rig file has 69250002; exchange"):
        Kpa101Pair((lambda: one, lambda: two), named, clock=in_memory.clock).connect()
    same = tuple(Head(FaceKind.PIN_CUSHION, LENGTH_M) for _ in range(2))
    with pytest.raises(DeviceRefused, match="both ports lead to unit 69250001"):
        Kpa101Pair((lambda: one, lambda: one), same, clock=in_memory.clock).connect()


def test_what_a_unit_refuses_carries_its_words(in_memory):
    in_memory.psd.connect()
    port = in_memory.bench.ports[0]
    answer = port.wire.refusal(b"\x71\x08\x03\x00\x50\x01")
    in_memory.lines[0].spoil = lambda data: answer if data else b""
    with pytest.raises(DeviceRefused, match="refused message 0x0871, code 9: injected refusal"):
        in_memory.psd.read(1.0)


@pytest.mark.parametrize(("light_a", "flag"), [(0.0, Flag.PSD1_NO_LIGHT), (200e-6, Flag.PSD1_SATURATED)])
def test_darkness_and_too_much_light_are_flagged(in_memory, light_a, flag):
    in_memory.world.light_a[0] = light_a
    in_memory.psd.connect()
    assert set(in_memory.psd.read(1.0).values["flags"]) == {flag}


def test_a_sum_above_half_of_its_scale_is_not_saturated(in_memory):
    """The sum counts to 65535, the differences to 32767: 60 uA in 100 kV/A are 6 of 10 V."""
    in_memory.world.light_a[0] = 60e-6
    in_memory.psd.connect()
    block = in_memory.psd.read(1.0)
    assert set(block.values["flags"]) == {0}
    assert block.values["sum_counts"][:, 0].min() > 32767
    for channel in in_memory.psd.describe():
        assert (np.abs(block.values[channel.name]) < channel.full_scale).all(), channel.name
    np.testing.assert_array_equal(counts_of(block.values, 1)[:, 2], block.values["sum_counts"][:, 0])
    np.testing.assert_array_equal(counts_of(block.values, 2)[:, :2], block.values["difference_counts"][:, 2:])


def test_connecting_again_goes_on_counting(in_memory):
    in_memory.psd.connect()
    last = in_memory.psd.read(1.0)
    in_memory.psd.connect()
    assert in_memory.psd.read(1.0).sequence[0] == last.sequence[-1] + 2


def test_status_updates_of_another_program_are_ended(in_memory):
    in_memory.lines[0].write(b"\x11\x00\x00\x00\x50\x01", 1.0)
    in_memory.clock.sleep_s(0.35)
    in_memory.psd.connect()
    in_memory.clock.sleep_s(0.35)
    assert in_memory.bench.ports[0].wire.due() == b""


@pytest.mark.parametrize("rate_hz", [0.0, 401.0, float("nan")])
def test_rates_beyond_the_line_are_refused(rate_hz):
    one = Head(FaceKind.PIN_CUSHION, LENGTH_M)
    with pytest.raises(ValueError, match="rate_hz"):
        Kpa101Pair((lambda: None, lambda: None), (one, one), rate_hz)


def test_heads_that_a_unit_does_not_take():
    with pytest.raises(ValueError, match="DUO_LATERAL: a KPA101 takes PIN_CUSHION, QUADRANT"):
        Head(FaceKind.DUO_LATERAL, LENGTH_M)
    with pytest.raises(ValueError, match="x_sign 2"):
        Wiring(x_sign=2)


def test_on_real_pseudo_terminals(served):
    def opened(port: str) -> SerialLine:
        line = open_serial(SerialAddress(port=port), BAUD)
        line.begin_apt(SystemClock())
        return line

    one, two = (Head(FaceKind.PIN_CUSHION, LENGTH_M) for _ in range(2))
    psd = Kpa101Pair((lambda: opened(served.ports[0]), lambda: opened(served.ports[1])), (one, two), 100.0)
    psd.connect()
    try:
        blocks = [psd.read(READ_S) for _ in range(5)]
    finally:
        psd.close()
    expected = served.world.spots_m[0] + served.world.spots_m[1]
    for block in blocks:
        np.testing.assert_allclose(spots_m(psd, block), [expected] * len(block.host_s), atol=COUNT_M)
