"""The encoder driver against the emulated nodes: on a real pseudo-terminal, and in memory where time is the test's."""

import math
import os

import can
import numpy as np
import pytest

from drivers.cia406.cycle import HOLD_S
from drivers.cia406.device import Cia406Encoders
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale
from drivers.transports.can_bus import bus_opener
from simulators.encoders.bus import CanFrame

NODES = [1, 2, 3, 4, 5, 6]
UNIT_RAD = math.tau / (1 << 20)
READ_S = 2.0


def on_wire(channel: str, nodes: list[int] = NODES, sync_hz: float = 200.0, bitrate: int = 1_000_000) -> Cia406Encoders:
    return Cia406Encoders(bus_opener("slcan", channel, bitrate), nodes, sync_hz)


# --- on the wire


def test_positions_of_six_turning_shafts(served):
    """0.5 rad/s of emulated time, which is host time here: the slope over host time, and the offsets between shafts."""
    encoders = on_wire(served.channel)
    encoders.connect()
    try:
        blocks = [encoders.read(READ_S) for _ in range(25)]
    finally:
        encoders.close()
    position_rad = np.concatenate([block.values["position_rad"] for block in blocks])
    device_s = np.concatenate([block.device_s for block in blocks])
    whole = np.isfinite(position_rad).all(axis=1)
    assert whole.sum() > 0.5 * len(whole)
    turned_rad = position_rad[whole] - served.world.start_rad
    np.testing.assert_allclose(turned_rad, turned_rad[:, :1].repeat(6, axis=1), atol=1.01 * UNIT_RAD)
    assert np.polyfit(device_s[whole], turned_rad[:, 0], 1)[0] == pytest.approx(0.5, rel=0.4)  # a busy host lags
    assert (np.diff(np.concatenate([block.sequence for block in blocks])) >= 1).all()
    assert (np.concatenate([block.host_s for block in blocks]) >= device_s).all()


def test_what_the_encoders_are(served):
    encoders = on_wire(served.channel)
    encoders.connect()
    encoders.close()
    assert [identity.serial_number for identity in encoders.identities] == [0xCB0000 + node for node in NODES]
    assert encoders.describe()[0].resolution == pytest.approx(UNIT_RAD)
    assert encoders.describe()[0].shape == (6,)


def test_missing_nodes_are_all_named(served):
    served.verbs["encoders.silence"](node=2)
    served.verbs["encoders.silence"](node=5)
    with pytest.raises(DeviceStale, match="no answer from encoder node 2, 5 of 6; check power, node numbers"):
        on_wire(served.channel).connect()


def test_another_bit_rate_reaches_nobody(served):
    with pytest.raises(DeviceStale, match=r"encoder node 1 of 1; .*bit rate"):
        on_wire(served.channel, nodes=[1], bitrate=500_000).connect()


def test_an_adapter_that_is_unplugged_is_lost_and_nothing_stays_open(served):
    before = len(os.listdir("/proc/self/fd"))
    encoders = on_wire(served.channel)
    encoders.connect()
    encoders.read(READ_S)
    served.unplug()
    with pytest.raises(DeviceLost, match="CAN adapter gone"):
        read_hundred(encoders)
    encoders.close()
    encoders.close()
    assert len(os.listdir("/proc/self/fd")) < before


def test_a_missing_adapter_is_lost(tmp_path):
    with pytest.raises(DeviceLost, match=r"CAN bus cannot be opened .*check the adapter"):
        on_wire(str(tmp_path / "no-adapter")).connect()


def test_an_unknown_interface_is_lost():
    with pytest.raises(DeviceLost, match="CAN bus cannot be opened"):
        Cia406Encoders(bus_opener("no-such-interface", "x", 1_000_000), [1]).connect()


# --- in memory


def test_positions_and_pace(memory):
    memory.encoders.connect()
    start_s = memory.clock.now_s()
    blocks = [memory.encoders.read(1.0) for _ in range(50)]
    sequence = np.concatenate([block.sequence for block in blocks])
    np.testing.assert_array_equal(sequence, np.arange(len(sequence)))
    np.testing.assert_allclose(memory.syncs_s(), start_s + 0.01 * np.arange(len(memory.syncs_s())), atol=1e-9)
    for block in blocks:
        np.testing.assert_allclose(block.values["position_rad"], [[math.tau / 4, -math.tau / 4]] * len(block.host_s))
        np.testing.assert_allclose(block.host_s - block.device_s, 0.001)


def test_sync_keeps_its_deadlines_when_answers_are_slow(memory):
    memory.encoders.connect()
    memory.bus.delay_s = 0.012
    start_s = memory.clock.now_s()
    blocks = [memory.encoders.read(1.0) for _ in range(20)]
    assert set(np.diff(np.concatenate([block.sequence for block in blocks]))) == {1}  # though longer than a period
    late_s = np.mod(np.array(memory.syncs_s()) - start_s + 1e-9, 0.01)
    assert late_s.max() < 0.003  # one in ten waits until the bus has come to rest


def test_a_lost_answer_is_nan_for_that_node_only(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    dropped = iter([True])
    memory.bus.lose = lambda frame: frame.id == 0x282 and next(dropped, False)
    blocks = [memory.encoders.read(1.0) for _ in range(10)]
    position_rad = np.concatenate([block.values["position_rad"] for block in blocks])
    assert np.isfinite(position_rad[:, 0]).all()
    uncertain = np.flatnonzero(np.isnan(position_rad[:, 1]))
    assert 2 <= uncertain.size <= HOLD_S * 100.0 + 2.0  # until the bus has come to rest, and the next
    np.testing.assert_array_equal(uncertain, uncertain[0] + np.arange(uncertain.size))
    assert np.isfinite(position_rad[-1]).all()


def test_a_node_silent_for_half_a_second_is_named_with_the_remedy(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.nodes[1].silent = True
    since_s = memory.clock.now_s()
    with pytest.raises(DeviceStale, match=r"encoder 2 has answered no SYNC for 0.5 s; check its power"):
        read_for(memory, 2.0)
    assert 0.5 <= memory.clock.now_s() - since_s < 0.8
    memory.nodes[1].silent = False
    assert np.isfinite(memory.encoders.read(1.0).values["position_rad"][-1, 0])


def test_a_node_whose_heartbeat_goes_on_is_not_asked_to_check_its_power(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.bus.lose = lambda frame: frame.id == 0x282
    with pytest.raises(DeviceStale, match="its heartbeat goes on: check SYNC and TPDO2"):
        read_for(memory, 2.0)


def test_when_nobody_answers_a_read_is_stale_in_time(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    for node in memory.nodes:
        node.silent = True
    before_s = memory.clock.now_s()
    with pytest.raises(DeviceStale, match=r"no encoder answered a SYNC within 0.3 s"):
        memory.encoders.read(0.3)
    assert memory.clock.now_s() - before_s == pytest.approx(0.3, abs=0.01)


def test_an_emergency_is_kept_and_recorded_and_the_stream_goes_on(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.nodes[1].raise_emergency(0x7320)
    blocks = [memory.encoders.read(1.0) for _ in range(3)]
    assert [(e.node, e.code) for e in memory.encoders.emergencies] == [(2, 0x7320)]
    assert blocks[-1].values["emergency_code"][-1].tolist() == [0, 0x7320]
    memory.nodes[1].raise_emergency(0)
    blocks = [memory.encoders.read(1.0) for _ in range(3)]
    assert blocks[-1].values["emergency_code"][-1].tolist() == [0, 0]


def test_a_restart_that_nobody_ordered_is_lost_and_connecting_again_heals_it(memory):
    memory.encoders.connect()
    last = memory.encoders.read(1.0)
    memory.nodes[0].reset()
    with pytest.raises(DeviceLost, match=r"encoder 1 has restarted by itself .*connect again"):
        read_for(memory, 1.0)
    again = Cia406Encoders(lambda: memory.bus, [1, 2], 100.0, clock=memory.clock)
    again.connect()
    assert np.isfinite(again.read(1.0).values["position_rad"]).all()
    assert last.sequence[-1] >= 0


def test_a_node_stopped_by_somebody_else_is_refused(memory):
    memory.encoders.connect()
    read_for(memory, 0.5)  # a heartbeat of every node has come
    memory.nodes[0].handle(CanFrame(0x000, b"\x02\x01"), memory.clock.now_s())
    with pytest.raises(DeviceRefused, match="encoder 1 is STOPPED, not operational"):
        read_for(memory, 1.0)


def test_a_heartbeat_that_crosses_the_start_command_is_no_fault(memory):
    memory.encoders.connect()
    memory.bus.put([CanFrame(0x701, b"\x7f")])
    read_for(memory, 1.0)


def test_another_profile_is_refused(memory):
    memory.nodes[1].dictionary.put(0x1000, 0, 0x0002_0191)
    with pytest.raises(DeviceRefused, match=r"encoder 2 is of device type 0x00020191 \(1000h\), profile 401"):
        memory.encoders.connect()


def test_an_encoder_that_lacks_an_object_is_refused_with_place_and_code(memory):
    del memory.nodes[0].dictionary.entries[0x6502, 0]
    with pytest.raises(DeviceRefused, match="encoder 1 refused reading 6502h:00, abort 0x06020000"):
        memory.encoders.connect()


def test_two_nodes_sending_under_one_identifier_are_refused(memory):
    memory.nodes[1].dictionary.put(0x1801, 1, 0x281)
    with pytest.raises(DeviceRefused, match="two encoders send TPDO2 under one identifier"):
        memory.encoders.connect()


def test_an_encoder_set_up_otherwise_is_mapped_anew(memory):
    """Alarms instead of the position, and on every third SYNC."""
    dictionary = memory.nodes[0].dictionary
    dictionary.put(0x1801, 2, 3)
    dictionary.put(0x1A01, 1, 0x65030010)
    memory.encoders.connect()
    assert np.isfinite(memory.encoders.read(1.0).values["position_rad"]).all()
    assert (dictionary.number(0x1A01, 1), dictionary.number(0x1801, 2)) == (0x60040020, 1)


def test_a_position_behind_other_objects_is_found(memory):
    dictionary = memory.nodes[0].dictionary
    dictionary.put(0x1A01, 0, 2)
    dictionary.put(0x1A01, 1, 0x65030010)
    dictionary.put(0x1A01, 2, 0x60040020)
    memory.encoders.connect()
    assert memory.encoders.read(1.0).values["position_rad"][0, 0] == pytest.approx(math.tau / 4)
    assert dictionary.number(0x1A01, 0) == 2


def test_scaling_and_clockwise_code_make_no_difference(memory):
    dictionary = memory.nodes[0].dictionary
    dictionary.put(0x6000, 0, 0x4)
    dictionary.put(0x6001, 0, 36_000)
    dictionary.put(0x6002, 0, 36_000 * 16)
    memory.encoders.connect()
    position_rad = memory.encoders.read(1.0).values["position_rad"][0, 0]
    assert position_rad == pytest.approx(math.tau / 4, abs=math.tau / 36_000)


def test_closing_leaves_the_nodes_pre_operational(memory):
    memory.encoders.connect()
    memory.encoders.close()
    assert [node.state.name for node in memory.nodes] == ["PRE_OPERATIONAL"] * 2


def test_frames_of_others_and_damaged_frames_are_left_out(memory):
    memory.encoders.connect()
    memory.bus.put(
        [CanFrame(0x281, b"\x01\x02"), CanFrame(0x3FF, b"x"), CanFrame(0x082, b"\x01"), CanFrame(0x705, b"\0")]
    )
    block = memory.encoders.read(1.0)
    assert np.isfinite(block.values["position_rad"]).all()
    assert memory.encoders.bad_frames == 2


@pytest.mark.parametrize(
    ("nodes", "sync_hz", "what"),
    [
        ([], 200.0, "nodes"),
        ([1, 1], 200.0, "nodes"),
        ([0], 200.0, "nodes"),
        ([128], 200.0, "nodes"),
        ([1], 0.0, "sync_hz"),
        ([1], 1001.0, "sync_hz"),
        ([1], math.nan, "sync_hz"),
    ],
)
def test_bad_settings_are_refused_early(nodes, sync_hz, what):
    with pytest.raises(ValueError, match=what):
        Cia406Encoders(can.Bus, nodes, sync_hz)


def test_reading_before_connecting_says_so(memory):
    with pytest.raises(DeviceLost, match="call connect"):
        memory.encoders.read(0.1)


def read_hundred(encoders: Cia406Encoders) -> None:
    """What was under way still comes; a hundred blocks would be two seconds of it."""
    for _ in range(100):
        encoders.read(READ_S)


def read_for(memory, seconds: float) -> None:
    """Reads until a fault comes, or that much of the test's time has passed."""
    until_s = memory.clock.now_s() + seconds
    while memory.clock.now_s() < until_s:
        memory.encoders.read(1.0)


# --- what a row costs, and when it is seen


def test_at_a_kilohertz_a_row_takes_one_waking(memory, monkeypatch: pytest.MonkeyPatch):
    """Its answers, 0.6 ms after the SYNC as those of six nodes at 1 Mbit/s, wait for the next SYNC."""
    memory.bus.delay_s = 0.0006
    encoders = Cia406Encoders(lambda: memory.bus, [1, 2], 1000.0, clock=memory.clock)
    encoders.connect()
    wakings: list[float] = []
    sleep_s, recv = memory.clock.sleep_s, memory.bus.recv

    def sleeping(seconds: float) -> None:
        wakings.append(seconds)
        sleep_s(seconds)

    def receiving(timeout: float | None = None) -> can.Message | None:
        if timeout:
            wakings.append(timeout)
        return recv(timeout)

    monkeypatch.setattr(memory.clock, "sleep_s", sleeping)
    monkeypatch.setattr(memory.bus, "recv", receiving)
    blocks = [encoders.read(READ_S) for _ in range(10)]
    sequence = np.concatenate([block.sequence for block in blocks])
    assert (np.diff(sequence) == 1).all()  # no SYNC without a row, no deadline left out
    assert np.isfinite(np.concatenate([block.values["position_rad"] for block in blocks])).all()
    assert len(wakings) <= len(sequence) + 2  # the first SYNC, and one that is under way
    taken_s = np.concatenate([block.host_s - block.device_s for block in blocks])
    assert taken_s.max() == pytest.approx(1e-3, abs=1e-9)


def test_at_slower_rates_an_answer_is_seen_when_it_comes(memory):
    memory.bus.delay_s = 0.0006
    memory.encoders.connect()
    block = memory.encoders.read(READ_S)
    np.testing.assert_allclose(block.host_s - block.device_s, 0.0006, atol=1e-9)


def test_a_reader_that_was_kept_from_running_does_not_call_the_encoders_silent(memory, monkeypatch):
    """No SYNC was sent meanwhile, so no encoder could answer one."""
    memory.encoders.connect()
    memory.encoders.read(0.5)
    recv, held_up = memory.bus.recv, iter((0.7,))

    def late(timeout=None):
        memory.clock.sleep_s(next(held_up, 0.0))
        return recv(timeout)

    monkeypatch.setattr(memory.bus, "recv", late)
    assert np.isfinite(memory.encoders.read(0.5).values["position_rad"]).all()
