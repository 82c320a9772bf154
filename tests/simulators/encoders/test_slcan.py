"""The serial adapter's commands, and the bus behind it: order, time, bit rate."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.encoders.bus import CanBus, CanFrame, as_line, bus_bits, from_line
from simulators.encoders.node import EncoderNode
from simulators.wire import TICK_S

DOCUMENT = Path(__file__).parents[3] / "docs/protocols/encoders.md"


def documented() -> dict[str, str]:
    block = DOCUMENT.read_text().split("```lines\n")[1].split("```")[0]
    return {line[:21].strip(): line[21:].strip() for line in block.splitlines()}


def test_the_documented_dialogue(adapter):
    lines = documented()
    adapter.open()
    assert adapter.send(lines["read 6004h"]) == b"z\r"
    assert adapter.run(0.01) == [lines["answer"]]
    assert adapter.send(lines["NMT start, all"], lines["SYNC"]) == b"z\rz\r"
    answers = adapter.run(0.01)
    assert answers[0] == lines["TPDO2"]
    assert len(answers) == 6
    adapter.send("t60182B171000C8000000")  # heartbeat every 200 ms
    assert lines["heartbeat"] in adapter.run(0.3)
    adapter.bench.verbs["encoders.emergency"](node=1, code=0x7320)
    assert lines["EMCY 7320h"] in adapter.run(0.01)


@pytest.mark.parametrize(
    ("commands", "answers"),
    [
        (["V", "N", ""], b"V1013\rNCB01\r\r"),
        (["F"], b"F00\r"),
        (["S6", "F"], b"\rF80\r"),  # another bit rate than the bus: errors
        (["S0", "S8"], b"\r\r"),
        (["S9"], b"\a"),
        (["S"], b"\a"),
        (["O"], b"\a"),  # no bit rate yet
        (["S8", "O", "O"], b"\r\r\a"),
        (["S8", "O", "S6"], b"\r\r\a"),
        (["C"], b"\a"),
        (["S8", "O", "C", "C"], b"\r\r\r\a"),
        (["t0800"], b"\a"),  # closed
        (["S8", "L", "t0800"], b"\r\r\a"),  # listening only
        (["S8", "O", "t0800", "T000000800", "r0810", "R000000810"], b"\r\rz\rZ\rz\rZ\r"),
        (["S8", "O", "t080", "t08010", "t8000", "t0809", "tXYZ0", "T800000000"], b"\r\r" + b"\a" * 6),
        (["Z1", "Z0", "S8", "O", "Z1"], b"\r\r\r\r\a"),  # open
        (["d0800", "Z2", "Oo", "\x00\xff", "x" * 500], b"\a" * 5),
    ],
)
def test_commands_and_answers(adapter, commands, answers):
    assert adapter.wire.handle("".join(c + "\r" for c in commands).encode("latin-1")) == answers


def test_a_command_in_pieces(adapter):
    adapter.open()
    whole = b"t0800\r"
    assert [adapter.wire.handle(bytes((byte,))) for byte in whole] == [b""] * 5 + [b"z\r"]


def test_nothing_is_heard_while_closed_or_at_another_bit_rate(adapter):
    adapter.run(0.01)
    adapter.send("S6", "O", "t0000", "t00020100", "t0800")
    assert adapter.run(0.02) == []
    adapter.send("C", "S8", "O", "t00020100", "t0800")
    assert len(adapter.run(0.02)) == 6
    adapter.send("t0800", "C")
    assert adapter.run(0.02) == []


def test_stamps_are_the_milliseconds_of_the_minute_in_which_a_frame_ended(adapter):
    adapter.world.time_s = 59.996
    adapter.send("S8", "Z1", "O")
    assert adapter.run(0.004) == [f"t70{node}100EA5E" for node in range(1, 7)]
    adapter.send("C", "Z0", "O", "t00020100", "t0800")
    assert {len(line) - 2 * int(line[4]) for line in adapter.run(0.01)} == {5}


def test_boot_up_messages_of_all_nodes_at_power_on(adapter):
    adapter.send("S8", "O")
    assert adapter.run(0.01) == [f"t70{node}100" for node in range(1, 7)]


@given(
    st.builds(
        lambda number, data, extended: CanFrame(number if extended else number & 0x7FF, data, extended=extended),
        st.integers(0, 0x1FFFFFFF),
        st.binary(max_size=8),
        st.booleans(),
    )
)
def test_a_frame_survives_its_line(frame):
    assert from_line(as_line(frame).decode().strip()) == frame


# --- bus


@pytest.mark.parametrize(("size", "low", "high"), [(0, 47, 55), (4, 79, 95), (8, 111, 135)])
def test_bits_of_a_frame_are_between_none_and_all_stuffed(size, low, high):
    assert low <= bus_bits(CanFrame(0x281, bytes(size))) <= high


def test_answers_come_in_the_order_of_their_identifiers_and_take_their_time():
    bus = CanBus(1_000_000, [EncoderNode(number, lambda: 0.0) for number in (3, 1, 2)])
    bus.run(1.0)
    bus.submit(CanFrame(0x000, b"\x01\x00"), 1.0)
    bus.submit(CanFrame(0x080), 1.0)
    bus.run(2.0)
    positions = [(end_s, frame.id) for end_s, frame in bus.heard if frame.id > 0x280 and frame.id < 0x300]
    assert [number for _, number in positions] == [0x281, 0x282, 0x283]
    start_s = 1.0 + (bus_bits(CanFrame(0, b"\0\0")) + bus_bits(CanFrame(0x80))) * 1e-6
    spacing_s = bus_bits(CanFrame(0x281, bytes(4))) * 1e-6
    assert [end_s for end_s, _ in positions] == pytest.approx([start_s + (i + 1) * spacing_s for i in range(3)])


def test_a_slow_bus_delivers_no_sooner_than_its_bits():
    """10 kbit/s: SYNC and six positions take 57 ms, the start command 7 ms before them."""
    nodes = [EncoderNode(number, lambda: 0.0) for number in range(1, 7)]
    for node in nodes:
        node.due(0.0)
    bus = CanBus(10_000, nodes)
    bus.submit(CanFrame(0x000, b"\x01\x00"), 0.0)
    bus.submit(CanFrame(0x080), 0.0)
    bus.run(0.05)
    assert len(bus.heard) == 4
    bus.run(0.065)
    assert len(bus.heard) == 6


def test_a_bus_with_more_than_it_can_carry_loses_frames_and_says_so():
    bus = CanBus(10_000, [])
    taken = [bus.submit(CanFrame(0x100, bytes(8)), 0.0) for _ in range(300)]
    assert taken.count(True) == 256
    assert bus.lost == 44


def test_positions_latch_when_the_sync_is_sent(adapter):
    adapter.open()
    adapter.send("t00020100")
    adapter.run(0.01)
    adapter.world.angle_rad = adapter.world.angle_rad * 0.0 + math.tau / 4
    adapter.send("t0800")
    adapter.world.angle_rad = adapter.world.angle_rad * 0.0
    assert adapter.run(2 * TICK_S)[0] == "t281400000400"
