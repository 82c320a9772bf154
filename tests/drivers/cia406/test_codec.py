"""Frames of encoders: mapped positions, emergencies, heartbeats, whatever junk comes."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia406.codec import MappedObject, NmtState, emergency, heartbeat_state, mapped_number, mapped_object

POSITION_ONLY = (mapped_object(0x60040020),)
ALARMS_FIRST = (mapped_object(0x65030010), mapped_object(0x60040020))
ODD_BITS = (mapped_object(0x20000003), mapped_object(0x60040020))


def position_in(mapping: tuple[MappedObject, ...], data: bytes) -> int | None:
    number = mapped_number(mapping, 0x6004)
    return None if number is None else number.read(data)


@pytest.mark.parametrize(
    ("mapping", "data", "position"),
    [
        (POSITION_ONLY, "00 00 04 00", 0x40000),
        (POSITION_ONLY, "ff ff ff ff", 0xFFFFFFFF),
        (POSITION_ONLY, "78 56 34 12 99 99 99 99", 0x12345678),  # longer than mapped: the rest is not ours
        (ALARMS_FIRST, "01 00 78 56 34 12", 0x12345678),
        (POSITION_ONLY, "00 00 04", None),
        (ALARMS_FIRST, "01 00 78 56 34", None),
        (POSITION_ONLY, "", None),
        ((), "00 00 04 00", None),
    ],
)
def test_the_position_is_where_the_mapping_says(mapping, data, position):
    assert position_in(mapping, bytes.fromhex(data)) == position


@given(st.integers(0, 2**32 - 1), st.integers(0, 7))
def test_an_object_may_begin_at_any_bit(position, before):
    data = (position << 3 | before).to_bytes(5, "little")
    assert position_in(ODD_BITS, data) == position


def test_an_emergency_as_documented():
    message = emergency(12.5, 3, bytes.fromhex("20 73 21 01 00 00 00 00"))
    assert message is not None
    assert (message.host_s, message.node, message.code, message.error_register) == (12.5, 3, 0x7320, 0x21)
    assert message.vendor == b"\x01\0\0\0\0"
    assert str(message) == "encoder 3: emergency 7320h, position error, error register 21h"


@given(st.binary(max_size=8))
def test_any_emergency_is_read_or_left_out(data):
    message = emergency(0.0, 1, data)
    assert (message is None) == (len(data) != 8)
    if message is not None:
        assert struct.pack("<HB5s", message.code, message.error_register, message.vendor) == data
        assert "emergency" in str(message)


@pytest.mark.parametrize(
    ("data", "state"),
    [
        ("00", NmtState.BOOT_UP),
        ("04", NmtState.STOPPED),
        ("05", NmtState.OPERATIONAL),
        ("7f", NmtState.PRE_OPERATIONAL),
        ("85", NmtState.OPERATIONAL),  # the toggle bit of node guarding
        ("33", None),
        ("", None),
        ("05 05", None),
    ],
)
def test_states_of_a_heartbeat(data, state):
    assert heartbeat_state(bytes.fromhex(data)) is state
