import re
import socket
import struct

import numpy as np
import pytest

from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.ur.reader import UrReader
from drivers.ur.rtde_codec import ControllerVersion


@pytest.fixture
def reader(emulated):
    reader = UrReader(emulated.host)
    reader.connect()
    yield reader
    reader.close()


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def requests(client: socket.socket):
    """The client's frames, until it goes."""
    stream = client.makefile("rb")
    while head := stream.read(3):
        size, kind = struct.unpack(">HB", head)
        yield chr(kind), stream.read(size - 3)


def read_on(reader: UrReader, timeout_s: float, numbers: list[int] | None = None) -> None:
    """Reads until it raises, a hundred blocks at most; notes the sequence numbers."""
    for _ in range(100):
        block = reader.read(timeout_s)
        if numbers is not None:
            numbers.extend(block.sequence)


def test_not_one_sample_is_lost(reader) -> None:
    blocks = [reader.read(1.0) for _ in range(200)]
    sequence = np.concatenate([block.sequence for block in blocks])
    device_s = np.concatenate([block.device_s for block in blocks])
    assert np.array_equal(sequence, np.arange(len(sequence)))
    assert np.diff(device_s) == pytest.approx(0.002, abs=1e-9)
    assert np.all(np.diff(np.concatenate([block.host_s for block in blocks])) >= 0.0)


def test_channels_are_in_si_and_of_the_declared_shape(reader) -> None:
    assert reader.version == ControllerVersion(5, 12, 0, 1101)
    assert reader.missing == ()
    block = reader.read(1.0)
    assert [channel.name for channel in reader.describe()] == list(block.values)
    for channel in reader.describe():
        assert block.values[channel.name].shape == (len(block.sequence), *channel.shape)
        assert block.values[channel.name].dtype in (np.float64, np.int64)
    assert block.values["robot_mode"].tolist() == [7] * len(block.sequence)
    assert block.values["safety_mode"].tolist() == [1] * len(block.sequence)
    assert np.all(block.values["joint_temperature_degC"] > 0.0)


def test_a_lower_rate_counts_in_its_own_cycles(emulated) -> None:
    reader = UrReader(emulated.host, rate_hz=125.0)
    reader.connect()
    blocks = [reader.read(1.0) for _ in range(20)]
    reader.close()
    assert np.array_equal(np.concatenate([b.sequence for b in blocks]), np.arange(sum(len(b.sequence) for b in blocks)))
    assert np.diff(np.concatenate([b.device_s for b in blocks])) == pytest.approx(0.008, abs=1e-9)


def test_a_protective_stop_shows_in_the_stream(emulated, reader) -> None:
    emulated.do("robot.protective_stop")
    for _ in range(200):
        block = reader.read(1.0)
        if block.values["safety_mode"][-1] == 3:
            break
    assert block.values["safety_mode"][-1] == 3
    assert block.values["safety_status_bits"][-1] & (1 << 2)


def test_a_silent_controller_is_stale_and_comes_back(emulated, reader) -> None:
    emulated.do("robot.silence", on=True)
    with pytest.raises(DeviceStale, match=re.escape(f"{emulated.host}:30004: no sample for 0.2 s")):
        read_on(reader, 0.2)
    emulated.do("robot.silence", on=False)
    assert len(reader.read(1.0).sequence) > 0


def test_a_gap_on_the_wire_is_a_jump_of_the_sequence(emulated, reader) -> None:
    numbers: list[int] = []
    emulated.do("robot.silence", on=True)
    with pytest.raises(DeviceStale):
        read_on(reader, 0.1, numbers)
    emulated.do("robot.silence", on=False)
    assert reader.read(1.0).sequence[0] > numbers[-1] + 50


def test_a_dropped_line_is_lost_and_can_be_connected_again(emulated, reader) -> None:
    emulated.do("robot.disconnect")
    with pytest.raises(DeviceLost, match="closed the connection"):
        read_on(reader, 0.5)
    with pytest.raises(DeviceLost, match="not connected"):
        reader.read(0.1)
    reader.connect()
    assert reader.read(1.0).sequence[0] == 0


def test_nobody_there(emulated) -> None:
    with pytest.raises(DeviceLost, match=re.escape(f"robot at {emulated.host}:1: cannot connect")):
        UrReader(emulated.host, port=1).connect()


def test_another_server_on_the_port_is_recognised(emulated) -> None:
    with pytest.raises(WireError, match="no RTDE at byte 0"):
        UrReader(emulated.host, port=29999).connect()


def test_a_server_that_says_nothing_is_stale(scripted, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.ur.reader.ANSWER_TIMEOUT_S", 0.2)
    server = scripted(lambda client: [None for _ in requests(client)])
    with pytest.raises(DeviceStale, match=r"no ProtocolAnswer within 0\.2 s"):
        UrReader("127.0.0.1", port=server.port).connect()


def older_controller(missing: set[str]):
    """Answers a handshake; knows every variable but the missing ones, and sends one package."""
    kinds = {
        "DOUBLE": "timestamp speed_scaling target_speed_fraction standard_analog_input0 standard_analog_input1 payload",
        "VECTOR6D": "target_q target_qd target_current actual_q actual_qd actual_current joint_temperatures "
        "actual_TCP_pose tcp_offset",
        "VECTOR3D": "payload_cog",
        "VECTOR6INT32": "joint_mode",
    }
    kind_by_name = {name: kind for kind, names in kinds.items() for name in names.split()}

    def kind_of(name: str) -> str:
        return "NOT_FOUND" if name in missing else kind_by_name.get(name, "INT32")

    def talk(client: socket.socket) -> None:
        types: list[str] = []
        for kind, payload in requests(client):
            match kind:
                case "V":
                    client.sendall(frame("V", b"\x01"))
                case "v":
                    client.sendall(frame("v", struct.pack(">4I", 5, 4, 0, 0)))
                case "O":
                    types = [kind_of(name) for name in payload[8:].decode().split(",")]
                    client.sendall(frame("O", b"\x01" + ",".join(types).encode()))
                case "S":
                    sizes = {"DOUBLE": 8, "VECTOR6D": 48, "INT32": 4, "VECTOR3D": 24, "VECTOR6INT32": 24}
                    client.sendall(frame("S", b"\x01") + frame("U", b"\x01" + bytes(sum(sizes[t] for t in types))))

    return talk


def test_a_variable_that_an_older_controller_lacks_is_left_out_and_named(scripted) -> None:
    reader = UrReader("127.0.0.1", port=scripted(older_controller({"payload"})).port)
    reader.connect()
    assert reader.missing == ("payload",)
    assert "payload_kg" not in reader.read(0.2).values
    assert "payload_kg" not in [channel.name for channel in reader.describe()]
    reader.close()


def test_without_joint_angles_there_is_nothing_to_record(scripted) -> None:
    with pytest.raises(DeviceRefused, match="no variable 'actual_q'"):
        UrReader("127.0.0.1", port=scripted(older_controller({"actual_q"})).port).connect()
