"""A controller that repeats itself, starts anew or goes quiet, as recorder and pulse see it."""

import struct
from collections.abc import Callable

import numpy as np
import pytest

from drivers.errors import DeviceLost, DeviceRefused, DeviceStale
from drivers.ur import pulse
from drivers.ur.pulse import Pulse, check_stream
from drivers.ur.reader import VARIABLES, UrReader


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def requests(client):
    stream = client.makefile("rb")
    while head := stream.read(3):
        size, kind = struct.unpack(">HB", head)
        yield chr(kind), stream.read(size - 3)


@pytest.fixture
def streaming(scripted) -> Callable[[list[float]], UrReader]:
    """A connected recorder of a server that sends packages with these time stamps at once, then nothing."""
    readers: list[UrReader] = []

    def start(stamps_s: list[float]) -> UrReader:
        def talk(client) -> None:
            for kind, payload in requests(client):
                if kind == "V":
                    client.sendall(frame("V", b"\1"))
                elif kind == "v":
                    client.sendall(frame("v", struct.pack(">4I", 5, 12, 0, 0)))
                elif kind == "O":
                    names = payload[8:].decode().split(",")
                    found = {"timestamp": "DOUBLE", "actual_q": "VECTOR6D"}
                    client.sendall(frame("O", b"\1" + ",".join(found.get(n, "NOT_FOUND") for n in names).encode()))
                elif kind == "S":
                    packages = [frame("U", struct.pack(">B7d", 1, stamp, *[stamp] * 6)) for stamp in stamps_s]
                    client.sendall(frame("S", b"\1") + b"".join(packages))

        reader = UrReader("127.0.0.1", port=scripted(talk).port)
        readers.append(reader)
        reader.connect()
        return reader

    yield start
    for reader in readers:
        reader.close()


def drained(reader: UrReader) -> list[float]:
    stamps_s: list[float] = []
    with pytest.raises(DeviceStale):
        read_on(reader, stamps_s)
    return stamps_s


def read_on(reader: UrReader, stamps_s: list[float]) -> None:
    while True:
        stamps_s += reader.read(0.05).device_s.tolist()


def test_a_package_that_was_sent_twice_counts_once(streaming) -> None:
    assert drained(streaming([1.0, 1.002, 1.002, 1.004, 1.002, 1.006])) == [1.0, 1.002, 1.004, 1.006]


def test_the_same_package_for_ever_is_stale(streaming) -> None:
    assert drained(streaming([1.0] + [1.002] * 50)) == [1.0, 1.002]


def test_a_clock_that_goes_back_is_a_controller_that_has_restarted(streaming) -> None:
    reader = streaming([100.0, 100.002, 0.5, 0.502])
    with pytest.raises(DeviceLost, match=r"its clock went back from 100\.002 to 0\.500 s, it has restarted"):
        drained(reader)


def test_everything_a_session_needs_is_recorded(emulated) -> None:
    reader = UrReader(emulated.host)
    reader.connect()
    values = reader.read(1.0).values
    reader.close()
    assert reader.missing == ()
    assert set(values) == {variable.channel.name for variable in VARIABLES}
    for name in ("safety_mode", "robot_mode", "speed_slider", "payload_kg", "tcp_offset_m_rad", "target_q_rad"):
        assert name in values
    assert values["speed_slider"][0] == 1.0
    assert values["payload_kg"][0] == 0.4  # of the rig file
    assert np.all(values["joint_mode"] == 253)
    assert np.all(np.abs(values["actual_tcp_pose_m_rad"][0, :3]) < 1.5)


class Clock:
    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s


@pytest.fixture
def beating(scripted, monkeypatch):
    """A pulse of a server that says what the test told it to, and a clock of the test's."""
    clock = Clock()

    def start(said: list[bytes]) -> Pulse:
        def talk(client) -> None:
            client.sendall(b"".join(said))
            client.recv(1000)
            client.recv(1000)

        monkeypatch.setattr(pulse, "RTDE_PORT", scripted(talk).port)
        started = Pulse("127.0.0.1", clock.now_s)
        started.wait(5.0)
        return started

    return start, clock


def package(stamp_s: float) -> bytes:
    return frame("U", struct.pack(">Bd", 1, stamp_s))


def test_a_pulse_lasts_as_long_as_its_limit(beating) -> None:
    start, clock = beating
    beat = start([frame("V", b"\1"), frame("S", b"\1"), package(1.0)])
    assert beat.begun
    clock.time_s = 0.3
    assert not beat.silent()
    clock.time_s = 0.6
    assert beat.silent()
    beat.close()


def test_a_refused_or_meaningless_stream_is_silent_at_once(beating) -> None:
    start, _ = beating
    for said in ([frame("S", b"\0")], [b"\0\0\0\0"]):
        beat = start(said)
        assert beat.silent()
        assert not beat.begun
        beat.close()


def test_before_connecting_a_quiet_controller_is_found_out(emulated) -> None:
    check_stream(emulated.host, "robot")
    emulated.do("robot.silence", on=True)
    with pytest.raises(DeviceStale, match="streams nothing"):
        check_stream(emulated.host, "robot")
    emulated.do("robot.silence", on=False)


def test_before_connecting_a_refusing_controller_is_found_out(scripted, monkeypatch) -> None:
    def refuse(client) -> None:
        client.sendall(frame("S", b"\0"))
        client.recv(1000)

    monkeypatch.setattr(pulse, "RTDE_PORT", scripted(refuse).port)
    with pytest.raises(DeviceRefused, match="refuses a stream"):
        check_stream("127.0.0.1", "robot")
