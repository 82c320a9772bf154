"""The bytes of the RTDE guide, frame by frame."""

import itertools
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simulators.ur.registers import Memory
from simulators.ur.rtde_server import RtdeServer, RtdeWire


def frame(kind: str, payload: bytes = b"") -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def frames(data: bytes) -> list[tuple[str, bytes]]:
    found = []
    while data:
        size, kind = struct.unpack_from(">HB", data)
        found.append((chr(kind), data[3:size]))
        data = data[size:]
    return found


def outputs(names: str, rate_hz: float = 500.0) -> bytes:
    return frame("O", struct.pack(">d", rate_hz) + names.encode())


@pytest.fixture
def wire(bench) -> RtdeWire:
    wire = bench.controller.rtde.accept()
    assert wire.handle(bytes.fromhex("0005560002")) == bytes.fromhex("00045601")  # version 2 asked for and granted
    return wire


def test_versions(bench) -> None:
    wire = bench.controller.rtde.accept()
    assert wire.handle(bytes.fromhex("0005560003")) == bytes.fromhex("00045600")
    assert wire.handle(bytes.fromhex("000376")) == bytes.fromhex("001376 00000005 0000000c 00000000 0000044d")


def test_a_recipe_with_a_trailing_comma_has_no_empty_type(wire) -> None:
    assert frames(wire.handle(outputs("timestamp,actual_q,"))) == [("O", b"\x01DOUBLE,VECTOR6D")]


def test_an_unknown_variable_is_not_found_and_the_recipe_does_not_start(wire) -> None:
    assert frames(wire.handle(outputs("timestamp,actual_w"))) == [("O", b"\x00DOUBLE,NOT_FOUND")]
    assert frames(wire.handle(frame("S"))) == [("S", b"\x00")]


def test_data_hold_the_controller_time_and_the_joints(bench, wire) -> None:
    wire.handle(outputs("timestamp,actual_q,robot_mode,safety_status_bits"))
    assert wire.due() == b""
    assert frames(wire.handle(frame("S"))) == [("S", b"\x01")]
    bench.run(0.01)
    ((kind, payload),) = frames(wire.due())
    assert kind == "U"
    assert payload[0] == 1
    timestamp, *q, mode, safety = struct.unpack(">d6diI", payload[1:])
    assert timestamp == pytest.approx(0.01)
    assert q == bench.world.joints().q_rad.tolist()
    assert (mode, safety) == (7, 1)


def test_protocol_version_1_has_no_recipe_id(bench) -> None:
    wire = bench.controller.rtde.accept()
    assert frames(wire.handle(frame("O", b"timestamp"))) == [("O", b"DOUBLE")]
    wire.handle(frame("S"))
    bench.run(0.002)
    assert wire.due() == struct.pack(">HBd", 11, ord("U"), 0.002)


@pytest.mark.parametrize(("rate_hz", "packages"), [(500.0, 500), (125.0, 125), (100.0, 100), (10.0, 10)])
def test_a_lower_frequency_sends_every_nth_cycle(bench, wire, rate_hz: float, packages: int) -> None:
    wire.handle(outputs("timestamp", rate_hz) + frame("S"))
    times = []
    for _ in range(500):
        bench.run(0.002)
        times += [struct.unpack_from(">d", payload, 1)[0] for _, payload in frames(wire.due())]
    assert len(times) == pytest.approx(packages, abs=1)
    assert np.diff(times) == pytest.approx(1.0 / rate_hz, abs=1e-9)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 501.0, float("nan"), float("inf")])
def test_an_impossible_frequency_is_refused_with_a_message(wire, rate_hz: float) -> None:
    ((kind, payload),) = frames(wire.handle(outputs("timestamp", rate_hz)))
    assert kind == "M"
    assert b"frequency" in payload


def test_input_recipes_are_numbered_and_owned(bench, wire) -> None:
    assert frames(wire.handle(frame("I", b"input_int_register_0"))) == [("I", b"\x01INT32")]
    assert frames(wire.handle(frame("I", b"input_double_register_0,input_double_register_1"))) == [
        ("I", b"\x02DOUBLE,DOUBLE")
    ]
    other = bench.controller.rtde.accept()
    assert frames(other.handle(frame("I", b"input_int_register_0"))) == [("I", b"\x00IN_USE")]
    bench.controller.memory.release(wire)
    assert frames(other.handle(frame("I", b"input_int_register_0"))) == [("I", b"\x01INT32")]


def test_an_oversized_input_packet_is_read_as_far_as_the_recipe_goes(bench, wire) -> None:
    wire.handle(frame("I", b"input_int_register_0,input_double_register_5"))
    assert wire.handle(frame("U", struct.pack(">Bid", 1, 42, 2.5) + bytes(48))) == b""
    assert bench.controller.memory.inputs.ints[0] == 42
    assert bench.controller.memory.inputs.doubles[5] == 2.5


def test_a_short_input_packet_changes_nothing_and_is_answered(bench, wire) -> None:
    wire.handle(frame("I", b"input_int_register_0,input_double_register_5"))
    ((kind, _),) = frames(wire.handle(frame("U", b"\x01\x00\x00")))
    assert kind == "M"
    assert bench.controller.memory.inputs.ints[0] == 0


def test_equal_recipes_are_packed_once_a_cycle(bench) -> None:
    wires = [bench.controller.rtde.accept() for _ in range(3)]
    for wire in wires:
        wire.handle(bytes.fromhex("0005560002") + outputs("timestamp,actual_q") + frame("S"))
    bench.run(0.002)
    first, second, third = (wire.due() for wire in wires)
    assert first is second is third


def test_a_frame_shorter_than_its_header_ends_the_connection(wire) -> None:
    wire.handle(b"\x00\x02U")
    assert wire.closing
    assert wire.handle(frame("v")) == b""


HANDSHAKE = (
    bytes.fromhex("0005560002") + frame("v") + outputs("timestamp,actual_q") + frame("I", b"input_int_register_1")
    + frame("U", struct.pack(">Bi", 1, 7)) + frame("S") + frame("P")
)  # fmt: skip


@given(cuts=st.lists(st.integers(0, len(HANDSHAKE)), max_size=12))
def test_any_split_of_the_bytes_gets_the_same_answers(cuts: list[int]) -> None:
    whole, parts = (RtdeServer(Memory(), (5, 12, 0, 1), lambda: pytest.fail("nothing streams")).accept() for _ in "ab")
    edges = [0, *sorted(cuts), len(HANDSHAKE)]
    answers = b"".join(parts.handle(HANDSHAKE[a:b]) for a, b in itertools.pairwise(edges))
    assert answers == whole.handle(HANDSHAKE)


@given(st.binary(max_size=200), st.integers(0, len(HANDSHAKE)))
@settings(max_examples=200)
def test_rubbish_raises_nothing_and_is_answered_with_whole_frames(rubbish: bytes, at: int) -> None:
    wire = RtdeServer(Memory(), (5, 12, 0, 1), lambda: pytest.fail("nothing streams")).accept()
    frames(wire.handle(HANDSHAKE[:at] + rubbish))
