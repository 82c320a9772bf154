"""How numbers stand in registers, checked against pymodbus' own coding and by hand."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.client import ModbusTcpClient

from drivers.modbus.register_map import DTYPES, Register, RegisterMap, Request

PYMODBUS = ModbusTcpClient("127.0.0.1")
SIX = [0.1, -0.2, 0.3, 0.0, 3.0, -3.0]


@pytest.mark.parametrize("order", ["big", "little"])
@pytest.mark.parametrize("kind", DTYPES)
def test_the_same_words_as_pymodbus(kind, order) -> None:
    register = Register("life", 0, kind, word_order=order)
    for number in (0, 1, 100, 4711):
        theirs = PYMODBUS.convert_to_registers(
            float(number) if "float" in kind else number, PYMODBUS.DATATYPE[kind.upper()], word_order=order
        )
        assert register.encode([number]) == theirs
        assert register.decode(theirs) == [number]


def test_six_floats_with_the_low_word_first() -> None:
    register = Register("actual_q_rad", 10, "float32", 6, word_order="little")
    assert register.encode([1.0] * 6) == [0x0000, 0x3F80] * 6
    assert register.decode([0x0000, 0x3F80] * 6).tolist() == [1.0] * 6


def test_a_scale_is_the_value_of_one_count() -> None:
    register = Register("joint_temperature_degC", 0, "int16", 6, scale=0.1)
    assert register.decode([0xFFFF, 215, 0, 0, 0, 0]) == pytest.approx([-0.1, 21.5, 0, 0, 0, 0])
    assert register.encode([-0.1, 21.5, 0, 0, 0, 0]) == [0xFFFF, 215, 0, 0, 0, 0]


def test_what_a_type_cannot_hold_is_no_value() -> None:
    with pytest.raises(ValueError, match="does not go into int16"):
        Register("command_q_rad", 0, "int16", 6, scale=0.001).encode([40.0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize(("angle_rad", "mrad", "turns"), [(0.5, 500, 0), (-0.001, 6282, 65535), (7.0, 717, 1)])
def test_ur_angles_are_a_part_of_a_turn_and_whole_turns(angle_rad, mrad, turns) -> None:
    """UR, "Modbus server data": registers 270 and 320 on."""
    register = Register("actual_q_rad", 270, "uint16", 6, scale=0.001, turns_address=320)
    assert register.decode([mrad] * 6, [turns] * 6) == pytest.approx([angle_rad] * 6, abs=6e-4)


@given(st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6))
def test_floats_come_back(values) -> None:
    register = Register("actual_q_rad", 0, "float64", 6)
    assert register.decode(register.encode(values)).tolist() == values


@pytest.mark.parametrize(
    "wrong", [{"type": "int8"}, {"address": -1}, {"address": 65530}, {"scale": 0.0}, {"scale": math.nan}, {"count": 0}]
)
def test_entries_that_cannot_be(wrong) -> None:
    with pytest.raises(ValueError, match="register actual_q_rad"):
        Register(**{"name": "actual_q_rad", "address": 0, "type": "float32", "count": 6, **wrong})


def joints(address: int = 0, **more) -> Register:
    return Register("actual_q_rad", address, "float32", 6, **more)


def test_neighbours_are_read_together() -> None:
    speeds, far = Register("actual_qd_rad_s", 12, "float32", 6), Register("life", 300, "uint16")
    found = RegisterMap([joints(), speeds, far])
    assert found.requests(list(found.registers)) == (Request("holding", 0, 24), Request("holding", 300, 1))


def test_gaps_are_read_across_only_where_stated() -> None:
    entries = [joints(), Register("life", 20, "uint16")]
    names = ["actual_q_rad", "life"]
    assert len(RegisterMap(entries).requests(names)) == 2
    assert RegisterMap(entries, read_across=8).requests(names) == (Request("holding", 0, 21),)


def test_no_request_is_longer_than_modbus_allows() -> None:
    entries = [joints(), Register("life", 124, "uint16"), Register("robot_mode", 125, "uint16")]
    found = RegisterMap(entries, read_across=200).requests([entry.name for entry in entries])
    assert [request.count for request in found] == [125, 1]


def test_tables_are_apart() -> None:
    entries = [joints(), Register("life", 12, "uint16", table="input")]
    assert [request.table for request in RegisterMap(entries).requests(["actual_q_rad", "life"])] == [
        "holding",
        "input",
    ]


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ([], "has no actual_q_rad"),
        ([joints(), joints()], "twice"),
        ([joints(), Register("q", 0, "int16")], "'q' is no known quantity"),
        ([Register("actual_q_rad", 0, "float32", 5)], "count 5, it has 6"),
        ([joints(), Register("stop", 50, "uint16", table="input")], "cannot be written"),
    ],
)
def test_maps_that_cannot_be(entries, says) -> None:
    with pytest.raises(ValueError, match=says):
        RegisterMap(entries)


def test_decoding_takes_the_words_by_table_and_address() -> None:
    found = RegisterMap([joints(address=3)])
    words = {("holding", 3 + k): word for k, word in enumerate(joints().encode(SIX))}
    assert found.decode("actual_q_rad", words) == pytest.approx(SIX, abs=1e-6)
    assert found.missing_for_motion[:2] == ("command_q_rad", "command_speed_rad_s")
    assert [channel.name for channel in found.readings] == ["actual_q_rad"]
