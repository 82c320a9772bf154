"""The binary streams of 30001 to 30003, read by the published tables."""

import struct

import pytest

from simulators.ur.emulator import VERSION
from simulators.ur.state_streams import CYCLES_PER_STATE, primary_stream, realtime_stream


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
    assert sorted(parts) == [0, 1, 2, 3, 4]
    assert {kind: len(part) + 5 for kind, part in parts.items()} == {0: 47, 1: 251, 2: 37, 3: 75, 4: 101}
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
