"""The binary streams of 30001 to 30003, read by the published tables."""

import math
import struct

import pytest

from simulators.ur.emulator import VERSION
from simulators.ur.state_streams import CYCLES_PER_STATE, primary_stream, realtime_stream

SIZES = {0: 47, 1: 251, 2: 37, 3: 75, 4: 101, 5: 225, 6: 445, 7: 61, 8: 9, 9: 53, 11: 26, 12: 8}  # of PolyScope 5.10 on


def sub_packages(data: bytes) -> dict[int, bytes]:
    found = {}
    while data:
        size, kind = struct.unpack_from(">IB", data)
        found[kind] = data[5:size]
        data = data[size:]
    return found


@pytest.fixture
def packages(bench):
    """What a client of 30002 gets in a second."""
    stream = primary_stream(lambda: bench.controller.rtde.readout, VERSION)
    data = b""
    for _ in range(500):
        bench.run(0.002)
        data += stream.due()
    found = []
    while data:
        size, kind = struct.unpack_from(">IB", data)
        found.append((kind, data[5:size]))
        data = data[size:]
    return found


def test_the_version_comes_first_then_ten_states_a_second(packages) -> None:
    assert [kind for kind, _ in packages] == [20] + [16] * (500 // CYCLES_PER_STATE)
    assert b"URControl" + struct.pack(">BBii", 5, 12, 0, 1101) in packages[0][1]


def test_joints_and_mode_stand_where_the_table_says(bench, packages) -> None:
    parts = sub_packages(packages[-1][1])
    assert {kind: len(part) + 5 for kind, part in parts.items()} == SIZES
    angles = [struct.unpack_from(">d", parts[1], 41 * joint)[0] for joint in range(6)]
    assert angles == pytest.approx(bench.controller.rtde.readout.q_rad)
    assert parts[0][15] == 7  # robot mode: running


def test_a_protective_stop_shows_in_the_flags(bench) -> None:
    bench.arm.protective_stop("test")
    bench.run(0.1)
    stream = primary_stream(lambda: bench.controller.rtde.readout, VERSION)
    data = stream.due()
    (length,) = struct.unpack_from(">I", data)
    flags = sub_packages(data[length + 5 :])[0][8:15]
    assert list(flags) == [1, 1, 1, 0, 1, 0, 0]  # connected, real, powered, no emergency, protective stop, no program


def test_the_real_time_stream_comes_every_cycle(bench) -> None:
    stream = realtime_stream(lambda: bench.controller.rtde.readout)
    sizes = []
    for _ in range(5):
        bench.run(0.002)
        data = stream.due()
        sizes.append(len(data))
        assert stream.due() == b""  # once a cycle
    assert sizes == [1220] * 5
    numbers = struct.unpack(">I152d", data)
    readout = bench.controller.rtde.readout
    assert numbers[0] == 1220
    assert numbers[1] == readout.timestamp_s
    assert list(numbers[32:38]) == readout.q_rad  # after time and five target vectors
    assert numbers[95] == 7.0  # robot mode


def test_kinematics_and_limits_are_those_of_the_arm(bench, packages) -> None:
    parts = sub_packages(packages[-1][1])
    arm = bench.arm.arm
    theta_a_d_alpha = struct.unpack(">6I24dI", parts[5])[6:30]
    assert list(theta_a_d_alpha) == [*arm.theta_offset_rad, *arm.a_m, *arm.d_m, *arm.alpha_rad]
    numbers = struct.unpack(">12d12d5d24d4I", parts[6])
    assert list(zip(numbers[0:12:2], numbers[1:12:2], strict=True)) == bench.arm.limits_rad
    assert numbers[12] == math.pi  # a joint's speed: 180 deg/s
    assert list(numbers[29:47]) == [*arm.a_m, *arm.d_m, *arm.alpha_rad]


def test_forces_stand_in_their_sub_packages(bench, packages) -> None:
    parts = sub_packages(packages[-1][1])
    readout = bench.controller.rtde.readout
    assert struct.unpack(">7d", parts[7])[:6] == readout.tool_wrench
    assert struct.unpack(">6d", parts[9]) == readout.raw_wrench
    assert math.hypot(*readout.tool_wrench[:3]) == pytest.approx(0.4 * 9.81)  # this bench states no payload


def test_what_urx_reads_of_the_real_time_stream_stands_where_it_looks(bench) -> None:
    """Places as in its struct for firmware 5.9, which counts from the time stamp on."""
    stream = realtime_stream(lambda: bench.controller.rtde.readout)
    bench.run(0.002)
    numbers = struct.unpack(">I152d", stream.due())[1:]
    readout = bench.controller.rtde.readout
    assert list(numbers[43:49]) == readout.current_a
    assert numbers[67:73] == readout.tool_wrench
    assert numbers[73:79] == readout.target_tool_pose
    assert list(numbers[86:92]) == readout.temperature_degC == [30.0] * 6
    assert numbers[94] == 7.0  # robot mode
    assert numbers[95:101] == (253.0,) * 6
    assert numbers[121:123] == (48.0, 48.0)  # main and robot voltage
    assert 0.1 < numbers[123] < 10.0
    assert numbers[124:130] == (48.0,) * 6
    assert numbers[131] == 1.0  # program stopped
    assert numbers[138] == 1.0  # safety normal


def test_a_refused_program_is_reported_on_the_primary_port_alone(bench) -> None:
    wires = {port: bench.controller.script_wire(port) for port in (30001, 30002)}
    wires[30002].handle(b"movep([0, 0, 0, 0, 0, 0])\n")
    bench.run(0.1)
    errors = {port: messages(wire.due()) for port, wire in wires.items()}
    assert errors[30002] == []
    [(kind, text)] = errors[30001]
    assert kind == 10  # a runtime exception
    assert b"movep" in text
    bench.run(0.1)
    assert messages(wires[30001].due()) == []  # once
    later = bench.controller.script_wire(30001)
    bench.run(0.1)
    assert messages(later.due()) == []  # and not to those who come later


def messages(data: bytes) -> list[tuple[int, bytes]]:
    """Type and text of the robot messages, without the version."""
    found = []
    while data:
        size, kind = struct.unpack_from(">IB", data)
        if kind == 20 and data[14] != 3:
            found.append((data[14], data[23:size]))
        data = data[size:]
    return found
