"""What happens on the bus and in encoders beside positions: heartbeats, error frames, slips, presets, single turns."""

import math

import can
import numpy as np
import pytest

from drivers.cia406.configuration import HEARTBEAT_MS
from drivers.cia406.device import Cia406Encoders
from drivers.cia406.health import Heartbeats
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale

PERIOD_S = HEARTBEAT_MS * 1e-3


def read_for(memory, seconds: float) -> list:
    until_s = memory.clock.now_s() + seconds
    blocks = []
    while memory.clock.now_s() < until_s:
        blocks.append(memory.encoders.read(1.0))
    return blocks


def read_hundred(encoders: Cia406Encoders) -> None:
    """Two seconds of 100 SYNCs a second."""
    for _ in range(100):
        encoders.read(1.0)


# --- heartbeats


def test_a_heartbeat_that_stays_away_is_found_within_one_and_a_half_periods(memory):
    """Positions go on: only the heartbeat is lost."""
    memory.encoders.connect()
    heard_s = [memory.clock.now_s()]
    taken = memory.bus.lose

    def note(frame) -> bool:
        if frame.id == 0x702:
            heard_s.append(memory.clock.now_s())
        return taken(frame)

    memory.bus.lose = note
    read_for(memory, 1.0)
    memory.bus.lose = lambda frame: frame.id == 0x702
    with pytest.raises(DeviceStale, match=r"no heartbeat from encoder 2 for 1.5 periods; check its power"):
        read_for(memory, 2.0)
    late_s = memory.clock.now_s() - heard_s[-1]
    assert 1.5 * PERIOD_S < late_s <= 1.5 * PERIOD_S + 0.03
    assert pytest.approx(0.6) == 1.5 * PERIOD_S


def test_heartbeats_that_come_are_never_missed(memory):
    memory.encoders.connect()
    read_for(memory, 20.0)


def test_a_host_that_slept_blames_nobody(memory):
    memory.encoders.connect()
    read_for(memory, 1.0)
    memory.clock.t_s += 3.0
    read_for(memory, 1.0)


def test_alive_time_leaves_pauses_out():
    heartbeats = Heartbeats([1, 2], 0.4, 0.01)
    heartbeats.begin(0.0)
    heartbeats.look(100.0)
    assert heartbeats.late() == ()
    for n in range(60):
        heartbeats.look(100.0 + 0.01 * n)
        heartbeats.heard(2)
    assert heartbeats.late() == (1,)
    assert heartbeats.late() == ()


@pytest.mark.parametrize("sync_hz", [200.0, 1000.0])
def test_a_silent_node_is_found_in_time_behind_an_adapter_that_hands_frames_over_in_bursts(sync_hz):
    burst_s, heartbeats, now_s, beat_s = 0.016, Heartbeats([1, 2], 0.4, 1.0 / sync_hz), 0.0, 0.4
    heartbeats.begin(0.0)
    while not (late := heartbeats.late()):
        now_s += burst_s
        heartbeats.look(now_s)
        if now_s >= beat_s:
            heartbeats.heard(2)
            beat_s += 0.4
    assert late == (1,)
    assert now_s == pytest.approx(1.5 * 0.4, abs=2 * burst_s)


class Slow:
    """Nodes answer every SYNC, 100 a second, and send a heartbeat each `beats_s`: an emulator on a busy machine."""

    def __init__(
        self, late_s: float, beats_s: float, nodes: tuple[int, ...] = (1, 2), *, in_turn: bool = False
    ) -> None:
        self.heartbeats = Heartbeats(nodes, 0.4, 0.01)
        self.heartbeats.begin(0.0)
        self.late_s, self.beats_s, self.nodes, self.now_s = late_s, beats_s, nodes, 0.0
        after_s = beats_s / len(nodes) if in_turn else 0.0  # node after node, else all at once
        self._beat_s = {node: beats_s + after_s * n for n, node in enumerate(nodes)}

    def found(self, until_s: float) -> tuple[int, ...]:
        """The first nodes that are called late."""
        while self.now_s < until_s:
            self.now_s += 0.01
            self.heartbeats.woke(self.late_s)
            self.heartbeats.look(self.now_s)
            for node in self.nodes:
                if self.now_s >= self._beat_s[node]:
                    self._beat_s[node] += self.beats_s
                    self.heartbeats.heard(node)
            if late := self.heartbeats.late():
                return late
        return ()


@pytest.mark.parametrize("nodes", [(1,), (1, 2)])
def test_slow_heartbeats_on_a_busy_machine_make_nobody_late(nodes):
    assert Slow(0.004, 2.0, nodes).found(60.0) == ()


def slowed(bus: Slow, factor: float) -> None:
    """From one period to the next by a third."""
    while bus.beats_s < factor * 0.4:
        bus.beats_s *= 4 / 3
        bus._beat_s = {node: bus.now_s + 4 / 3 * (due_s - bus.now_s) for node, due_s in bus._beat_s.items()}
        assert bus.found(bus.now_s + bus.beats_s) == ()


def test_six_that_send_in_turn_and_become_slow_make_nobody_late():
    bus = Slow(0.0, 0.4, (1, 2, 3, 4, 5, 6), in_turn=True)
    assert bus.found(4.0) == ()
    slowed(bus, 7.0)
    assert bus.found(60.0) == ()


def test_an_emulator_that_is_held_up_between_the_heartbeats_of_two_nodes_makes_nobody_late():
    bus = Slow(0.0, 0.4, (1, 2), in_turn=True)
    bus.found(2.0)
    for _ in range(10):
        assert bus.found(bus._beat_s[1] + 0.01) == ()
        bus.now_s += 0.35  # nothing is heard
        bus._beat_s = {node: due_s + 0.35 for node, due_s in bus._beat_s.items()}


def test_one_node_is_found_among_slow_ones():
    bus = Slow(0.004, 2.0)
    bus.found(2.1)
    bus.nodes = (2,)
    assert bus.found(10.0) == (1,)
    assert bus.now_s < 2 * 2.0 + 0.25


def test_one_of_six_that_send_in_turn_is_found():
    """On a quiet machine after one and a half periods; where the others take more, after as much of theirs."""
    for slower in (1.0, 2.5):
        bus = Slow(0.0, 0.4, (1, 2, 3, 4, 5, 6), in_turn=True)
        bus.found(2.0)
        slowed(bus, slower)
        bus.found(bus.now_s + 2 * bus.beats_s)
        bus.nodes = tuple(node for node in bus.nodes if node != 3)
        last_s = bus._beat_s[3] - bus.beats_s
        assert bus.found(60.0) == (3,)
        assert bus.now_s - last_s == pytest.approx(1.5 * bus.beats_s, abs=0.1 * slower)


@pytest.mark.parametrize("nodes", [(1,), (1, 2)])
def test_heartbeats_of_all_that_stay_away_are_found_in_one_and_a_half_periods_when_nobody_was_busy(nodes):
    bus = Slow(0.001, math.inf, nodes)
    assert bus.found(10.0) == nodes
    assert bus.now_s == pytest.approx(1.5 * 0.4, abs=0.02)


def test_a_busy_machine_excuses_so_much_and_no_more():
    bus = Slow(0.009, math.inf)
    assert bus.found(60.0) == (1, 2)
    assert bus.now_s == pytest.approx(15 * 0.4, abs=0.02)


def test_who_was_late_is_said(memory, monkeypatch):
    memory.encoders.connect()
    read_for(memory, 1.0)
    memory.bus.lose = lambda frame: frame.id in (0x701, 0x702)
    recv = memory.bus.recv

    def late(timeout=None):
        if timeout:
            memory.clock.sleep_s(0.004)
        return recv(timeout)

    monkeypatch.setattr(memory.bus, "recv", late)
    # whose heartbeat was the last but one is late first, unless both had come within a SYNC
    busy = r"encoder (1|2|1, 2) for 1.5 periods; this computer was busy for \d\.\d s, end other programs; else"
    with pytest.raises(DeviceStale, match=busy):
        read_for(memory, 10.0)


def test_a_node_that_is_silent_on_a_busy_machine_is_found_within_a_second_and_the_message_says_busy(
    memory, monkeypatch
):
    memory.encoders.connect()
    read_for(memory, 1.0)
    for node in memory.nodes:
        node.silent = True
    recv, since_s = memory.bus.recv, memory.clock.now_s()

    def late(timeout=None):
        if timeout:
            memory.clock.sleep_s(0.03)
        return recv(timeout)

    monkeypatch.setattr(memory.bus, "recv", late)
    busy = r"encoder 1, 2 has answered no SYNC for 0.5 s; this computer was busy for \d\.\d s, end other programs; else"
    with pytest.raises(DeviceStale, match=busy):
        read_for(memory, 10.0)
    assert 0.5 < memory.clock.now_s() - since_s < 1.3


# --- the bus itself


def error_frame(bits: int) -> can.Message:
    return can.Message(arbitration_id=bits, is_error_frame=True, is_extended_id=True, data=bytes(8))


def test_error_frames_are_kept_and_recorded_and_the_stream_goes_on(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.bus.errors += [error_frame(0x08), error_frame(0x20)]
    block = memory.encoders.read(1.0)
    assert block.values["bus_errors"][-1] == 2
    assert [str(fault) for fault in memory.encoders.bus_faults] == [
        "protocol violation",
        "no acknowledgement: no other node on the bus, or another bit rate",
    ]


def test_bus_off_is_lost_with_what_went_before(memory):
    memory.encoders.connect()
    memory.bus.errors += [error_frame(0x88), error_frame(0x40)]
    with pytest.raises(DeviceLost, match=r"bus-off after 2 error frames, the last: bus off; check bit rate"):
        memory.encoders.read(1.0)


def test_an_adapter_that_says_it_is_bus_off_is_trusted(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.bus.said = can.BusState.ERROR
    memory.bus.lose = lambda frame: True
    with pytest.raises(DeviceLost, match="bus-off"):
        read_hundred(memory.encoders)


# --- encoders


def test_a_slip_is_recorded_and_the_position_reported_as_it_is(memory):
    slipping = Cia406Encoders(lambda: memory.bus, [1, 2], 100.0, clock=memory.clock, acceleration_limit_rad_s2=20.0)
    slipping.connect()
    before = slipping.read(1.0)
    encoder = memory.nodes[1].encoder
    whole = encoder._angle_rad
    encoder._angle_rad = lambda: whole() + 0.02
    blocks = [slipping.read(1.0) for _ in range(5)]
    ((node, slip),) = slipping.slips
    assert node == 2
    assert slip.size_rad == pytest.approx(0.02, abs=1e-5)
    assert before.values["slip_rad"][-1].tolist() == [0.0, 0.0]
    np.testing.assert_allclose(blocks[-1].values["slip_rad"][-1], [0.0, 0.02], atol=1e-5)
    assert blocks[-1].values["position_rad"][-1, 1] == pytest.approx(-math.tau / 4 + 0.02, abs=1e-5)
    assert np.isnan(np.concatenate([b.values["position_rad"] for b in blocks])[:, 1]).sum() == 2


def test_a_preset_moves_the_zero_and_streaming_goes_on(memory):
    memory.encoders.connect()
    memory.encoders.read(1.0)
    memory.encoders.preset(2, 1.25)
    block = memory.encoders.read(1.0)
    np.testing.assert_allclose(block.values["position_rad"][-1], [math.tau / 4, 1.25], atol=1e-5)
    assert memory.nodes[1].dictionary._stored == {}
    memory.encoders.preset(2, -1.0, store=True)
    assert memory.encoders.read(1.0).values["position_rad"][-1, 1] == pytest.approx(-1.0, abs=1e-5)
    assert memory.nodes[1].dictionary._stored


def test_a_preset_of_a_clockwise_and_scaled_encoder(memory):
    dictionary = memory.nodes[0].dictionary
    dictionary.put(0x6000, 0, 0x4)
    dictionary.put(0x6001, 0, 36_000)
    dictionary.put(0x6002, 0, 36_000 * 16)
    memory.encoders.connect()
    memory.encoders.preset(1, 0.5)
    assert memory.encoders.read(1.0).values["position_rad"][-1, 0] == pytest.approx(0.5, abs=math.tau / 36_000)


def test_direction_is_set_and_angles_stay_counter_clockwise(memory):
    memory.encoders.connect()
    memory.encoders.set_direction(1, counter_clockwise=False)
    assert memory.nodes[0].dictionary.number(0x6000) & 1 == 0
    assert memory.encoders.identities[0].scale.unit_rad < 0.0
    assert memory.encoders.read(1.0).values["position_rad"][-1, 0] == pytest.approx(math.tau / 4, abs=1e-5)


def test_what_cannot_be_preset_is_refused(memory):
    memory.encoders.connect()
    with pytest.raises(ValueError, match="no encoder 9; there are 1, 2"):
        memory.encoders.preset(9, 0.0)
    del memory.nodes[0].dictionary.entries[0x6003, 0]
    with pytest.raises(DeviceRefused, match=r"encoder 1 refused writing .* to 6003h:00"):
        memory.encoders.preset(1, 0.0)


def test_a_single_turn_encoder(memory):
    """As data sheets of single-turn devices say it: 6502h is 1, or 0, and the position ends with the turn."""
    for node, turns in zip(memory.nodes, (1, 0), strict=True):
        node.dictionary.put(0x1000, 0, 0x0001_0196)
        node.dictionary.put(0x6502, 0, turns)
        node.dictionary.put(0x6000, 0, 0x5)
        node.dictionary.put(0x6001, 0, 1 << 20)
        node.dictionary.put(0x6002, 0, 1 << 20)
    memory.encoders.connect()
    np.testing.assert_allclose(
        memory.encoders.read(1.0).values["position_rad"][-1], [math.tau / 4, -math.tau / 4], atol=1e-5
    )
