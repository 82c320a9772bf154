"""Plain encoders described by a DBC file: the emulated ones on a pseudo-terminal, others on a bus in memory."""

import math
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np
import pytest

from drivers.can_dbc.description import joint_signals
from drivers.can_dbc.device import CanDbcEncoders
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale
from drivers.transports.can_bus import bus_opener
from simulators.encoders.emulator import build
from simulators.host.loop import Host
from tests.drivers.transports.stamping_adapter import SPEED_RAD_S, START_RAD, StampingAdapter

ROOT = Path(__file__).parents[3]
PLAIN = ROOT / "rigs/encoders-plain.dbc"
CIA406 = ROOT / "rigs/encoders-cia406.dbc"
SIGNALS = [f"ENCODER{n}.Angle" for n in range(1, 7)]
UNIT_RAD = math.tau / (1 << 20)
ODD = """VERSION "1"

NS_ :

BS_:

BU_: one

BO_ 2147483905 LINK: 8 one
 SG_ Mode M : 0|2@1+ (1,0) [0|3] "" one
 SG_ Joint m1 : 2|12@1+ (-0.1,90) [-319.5|90] "deg" one
 SG_ Other m2 : 2|12@1+ (1,0) [0|4095] "" one
 SG_ Count : 16|16@0+ (1,0) [0|35999] "" one

BO_ 300 REAL: 4 one
 SG_ Angle : 0|32@1- (1,0) [0|0] "rad" one

SIG_VALTYPE_ 300 Angle : 1;
"""


class Shafts:
    """Six shafts at half a radian a second of emulated time."""

    def __init__(self) -> None:
        self.time_s = 0.0
        self.start_rad = np.array([0.0, -1.0, 2.0, -3.0, 4.0, 100.0])

    def advance(self, until_s: float) -> None:
        self.time_s = until_s

    def link_encoders_rad(self) -> np.ndarray:
        return self.start_rad + 0.5 * self.time_s


@dataclass
class Served:
    channel: str
    world: Shafts
    verbs: dict


@pytest.fixture
def served() -> Iterator[Served]:
    world = Shafts()
    device = {"driver": "can-dbc", "signals": SIGNALS, "sync_hz": 100.0, "channel": "can0"}
    bench = build(world, {"devices": {"encoders": device}})
    host = Host(bench, world)
    stop = threading.Event()
    thread = threading.Thread(target=host.run, args=(stop.is_set,))
    thread.start()
    try:
        yield Served(host.serial_address("can"), world, dict(bench.verbs))
    finally:
        stop.set()
        thread.join()
        host.close()


def on_wire(served: Served) -> CanDbcEncoders:
    joints = joint_signals(PLAIN, SIGNALS, None)
    return CanDbcEncoders(bus_opener("slcan", served.channel, 1_000_000), joints)


def test_six_plain_encoders_on_the_wire(served):
    encoders = on_wire(served)
    encoders.connect()
    try:
        blocks = [encoders.read(2.0) for _ in range(10)]
    finally:
        encoders.close()
    position_rad = np.concatenate([block.values["position_rad"] for block in blocks])
    whole = np.isfinite(position_rad).all(axis=1)
    assert whole.sum() > 0.5 * len(whole)
    start_rad = served.world.start_rad
    turned_rad = position_rad[whole] - start_rad
    np.testing.assert_allclose(turned_rad, turned_rad[:, :1].repeat(6, axis=1), atol=1.01 * UNIT_RAD + 0.5 * 0.01)
    np.testing.assert_array_equal(np.diff(np.concatenate([block.sequence for block in blocks])), 1)
    assert encoders.describe()[0].resolution == pytest.approx(UNIT_RAD)


def test_an_encoder_that_is_silent_is_named(served):
    served.verbs["encoders.silence"](node=4)
    with pytest.raises(DeviceStale, match=r"nothing heard of ENCODER4.Angle within 1 s"):
        on_wire(served).connect()


def test_a_missing_bus_is_lost():
    with pytest.raises(DeviceLost, match="cannot be opened"):
        CanDbcEncoders(bus_opener("slcan", "no-such-port", 1_000_000), joint_signals(PLAIN, SIGNALS, None)).connect()


def test_rows_have_the_time_of_the_adapter_also_when_they_come_in_a_burst_over_its_minute():
    adapter = StampingAdapter(time_s=59.93)

    def open_bus() -> can.BusABC:
        adapter.run(0.02)  # nothing is heard while it is closed
        bus = adapter.open()
        adapter.run(0.1)  # ten rows, before the first is read
        return bus

    encoders = CanDbcEncoders(open_bus, joint_signals(PLAIN, SIGNALS, None), stamps="hardware")
    encoders.connect()
    try:
        blocks = [encoders.read(0.02)]
        adapter.run(0.1)
        blocks.append(encoders.read(0.02))
    finally:
        encoders.close()
        adapter.close()
    device_s = np.concatenate([block.device_s for block in blocks])
    turned_rad = np.concatenate([block.values["position_rad"] for block in blocks]) - START_RAD
    assert len(device_s) > 15
    np.testing.assert_allclose(np.diff(device_s), 0.01, atol=0.0011)
    for block in blocks:
        assert np.ptp(block.host_s) < 0.5 * np.ptp(block.device_s)
        assert block.values["age_s"].max() < 0.003  # six frames of 0.12 ms, stamps of 1 ms
    read_s = turned_rad.mean(axis=1) / SPEED_RAD_S  # when the shafts stood there
    assert np.ptp(device_s - read_s) < 0.0021
    assert encoders.stamps == "hardware"


# --- in memory


class SteppedClock:
    def __init__(self) -> None:
        self.t_s = 5.0

    def now_s(self) -> float:
        return self.t_s

    def sleep_s(self, seconds: float) -> None:
        self.t_s += seconds


class ScriptedBus(can.BusABC):
    """Frames at their times; an idle wait passes the test's time."""

    def __init__(self, clock: SteppedClock, frames: list[tuple[float, can.Message]]) -> None:
        super().__init__(channel="scripted")
        self.clock, self.frames = clock, frames

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise AssertionError("a passive driver has sent something")

    def recv(self, timeout: float | None = None) -> can.Message | None:
        until_s = self.clock.t_s + (timeout or 0.0)
        if self.frames and self.frames[0][0] <= until_s:
            at_s, message = self.frames.pop(0)
            self.clock.t_s = max(self.clock.t_s, at_s)
            return message
        self.clock.t_s = until_s
        return None


def angle_frame(node: int, counts: int) -> can.Message:
    data = (counts & 0xFFFFFFFF).to_bytes(4, "little") + b"\0\0"
    return can.Message(arbitration_id=0x100 + node, data=data, is_extended_id=False)


def scripted(frames: list[tuple[float, can.Message]], names: list[str]) -> CanDbcEncoders:
    clock = SteppedClock()
    bus = ScriptedBus(clock, frames)
    return CanDbcEncoders(lambda: bus, joint_signals(PLAIN, names, None), clock=clock)


def test_a_reading_that_is_missing_is_nan_and_ages_are_reported():
    frames = [(5.0, angle_frame(1, 0)), (5.001, angle_frame(2, 0))]
    frames += [(5.01, angle_frame(1, 1 << 14)), (5.013, angle_frame(2, 1 << 14))]
    frames += [(5.02, angle_frame(1, 1 << 14)), (5.03, angle_frame(1, 1 << 14)), (5.031, angle_frame(2, 1 << 14))]
    encoders = scripted(frames, SIGNALS[:2])
    encoders.connect()
    blocks = [encoders.read(0.05), encoders.read(0.05)]
    position_rad = np.concatenate([block.values["position_rad"] for block in blocks])
    np.testing.assert_allclose(position_rad, math.tau / 64 * np.array([[1, 1], [1, np.nan], [1, 1]]))
    np.testing.assert_allclose(blocks[0].values["age_s"][0], [0.003, 0.0], atol=1e-12)
    encoders.close()


def test_damaged_and_error_frames_are_counted_and_the_stream_goes_on():
    short = can.Message(arbitration_id=0x101, data=b"\1\2", is_extended_id=False)
    error = can.Message(arbitration_id=0x08, is_error_frame=True)
    frames = [(5.0, angle_frame(1, 0)), (5.01, short), (5.015, error), (5.02, angle_frame(1, 9))]
    encoders = scripted(frames, SIGNALS[:1])
    encoders.connect()
    block = encoders.read(0.05)
    assert encoders.bad_frames == 1
    assert block.values["bus_errors"][-1] == 1
    assert block.values["position_rad"][-1, 0] == pytest.approx(9 * UNIT_RAD)
    encoders.close()


def test_rows_from_before_a_failure_are_not_lost_with_it():
    bus_off = can.Message(arbitration_id=0x40, is_error_frame=True)
    frames = [(5.0, angle_frame(1, 0)), (5.01, angle_frame(1, 9)), (5.011, bus_off)]
    frames += [(5.02, angle_frame(1, 10)), (5.03, angle_frame(1, 11)), (5.04, angle_frame(1, 12))]
    encoders = scripted(frames, SIGNALS[:1])
    encoders.connect()
    with pytest.raises(DeviceLost, match="bus-off"):
        encoders.read(0.05)
    encoders.connect()
    block = encoders.read(0.05)
    assert block.values["position_rad"][:2, 0] == pytest.approx([9 * UNIT_RAD, 11 * UNIT_RAD])
    assert block.values["bus_errors"].tolist()[:2] == [0, 1]
    assert block.sequence[1] > block.sequence[0] + 1  # what passed between is not known to be nothing
    encoders.close()


def test_one_that_falls_silent_is_named():
    frames = [(5.0, angle_frame(1, 0)), (5.0, angle_frame(2, 0))]
    frames += [(5.0 + 0.01 * n, angle_frame(1, 0)) for n in range(1, 200)]
    encoders = scripted(frames, SIGNALS[:2])
    encoders.connect()
    with pytest.raises(DeviceStale, match=r"ENCODER2.Angle sent nothing for 0.5 s; check its power"):
        read_hundred(encoders)
    encoders.close()


def read_hundred(encoders: CanDbcEncoders) -> None:
    for _ in range(100):
        encoders.read(0.1)


# --- the file


@pytest.fixture
def odd(tmp_path) -> Path:
    path = tmp_path / "odd.dbc"
    path.write_text(ODD)
    return path


def test_multiplexed_extended_scaled_and_clockwise(odd):
    (joint,) = joint_signals(odd, ["LINK.Joint"], None)
    assert joint.frame == (0x101, True)
    assert joint.scale.units_per_turn == pytest.approx(3600)
    assert joint.scale.range_units == math.inf  # 409.5 degrees are no circle
    raw = 900  # 90 deg - 0.1 deg * 900 = 0
    data = (1 | raw << 2).to_bytes(2, "little") + bytes(6)
    assert joint.counts(data) == 900
    assert (900 + joint.scale.offset_units) * joint.scale.unit_rad == pytest.approx(0.0)
    assert joint.counts((2 | raw << 2).to_bytes(2, "little") + bytes(6)) is None  # another signal's turn
    assert joint.counts(b"") is None


def test_counts_without_a_unit_need_their_number_a_turn(odd):
    with pytest.raises(DeviceRefused, match="unit '' is no angle; give units_per_turn"):
        joint_signals(odd, ["LINK.Count"], None)
    (joint,) = joint_signals(odd, ["LINK.Count"], 36000)
    assert joint.scale.unit_rad == pytest.approx(math.tau / 36000)
    assert joint.scale.range_units == 36000  # the stated end, not the 65536 of its bits


@pytest.mark.parametrize(
    ("ends", "range_units"),
    [("0|360", 3600), ("0|359.9", 3600), ("-180|180", 3600), ("0|720", 7200), ("0|90", math.inf), ("0|0", 1 << 16)],
)
def test_ends_that_are_whole_turns_apart_are_one_place(tmp_path, ends, range_units):
    (tmp_path / "turn.dbc").write_text(
        f'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: one\n\nBO_ 5 AXIS: 2 one\n'
        f' SG_ Angle : 0|16@1+ (0.1,0) [{ends}] "deg" one\n'
    )
    (joint,) = joint_signals(tmp_path / "turn.dbc", ["AXIS.Angle"], None)
    assert joint.scale.range_units == range_units


def test_what_a_file_cannot_give_is_refused(odd, tmp_path):
    with pytest.raises(DeviceRefused, match=r"no signal 'LINK.Elbow' in .*odd.dbc; there are LINK.Count"):
        joint_signals(odd, ["LINK.Elbow"], None)
    with pytest.raises(DeviceRefused, match="cannot be read as a DBC file"):
        joint_signals(tmp_path / "none.dbc", [], None)
    (tmp_path / "rubbish.dbc").write_text("BO_ rubbish")
    with pytest.raises(DeviceRefused, match="cannot be read as a DBC file"):
        joint_signals(tmp_path / "rubbish.dbc", [], None)


def test_the_position_of_a_cia406_encoder_reads_the_same_through_its_dbc():
    (joint,) = joint_signals(CIA406, ["TPDO2_1.Position"], None)
    assert joint.scale.unit_rad == pytest.approx(UNIT_RAD)
    assert joint.scale.range_units == 1 << 32
    assert joint.counts(bytes.fromhex("00000400")) == 1 << 18
