"""Angle to position: resolution, direction, wrap, scaling, preset."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulators.encoders.object_dictionary import AbsoluteEncoder, NodeDictionary, SdoAbort

TURN = 1 << 20
RANGE = 1 << 32


class Shaft:
    def __init__(self, angle_rad: float = 0.0) -> None:
        self.angle_rad = angle_rad
        self.dictionary = NodeDictionary(1)
        self.encoder = AbsoluteEncoder(lambda: self.angle_rad, self.dictionary)

    def at(self, angle_rad: float) -> int:
        self.angle_rad = angle_rad
        return self.encoder.position()


@pytest.mark.parametrize(
    ("turns", "position"),
    [(0.0, 0), (0.25, TURN // 4), (1.0, TURN), (-0.25, RANGE - TURN // 4), (4096.0, 0), (4095.5, RANGE - TURN // 2)],
)
def test_position_of_turns(turns, position):
    assert Shaft().at(turns * math.tau) == position


@given(st.floats(-100.0, 100.0))
def test_quantisation_is_one_unit_downwards(angle_rad):
    units = Shaft().at(angle_rad)
    units -= RANGE if units >= RANGE // 2 else 0
    assert -1e-6 <= angle_rad / math.tau * TURN - units <= 1.0 + 1e-6


def test_clockwise_code_falls_with_the_angle():
    shaft = Shaft()
    shaft.dictionary.put(0x6000, 0, 0)
    assert shaft.at(math.tau / 4) == RANGE - TURN // 4


def test_scaling_sets_units_and_range():
    shaft = Shaft()
    shaft.dictionary.put(0x6000, 0, 0x5)
    shaft.dictionary.put(0x6001, 0, 36_000)
    shaft.dictionary.put(0x6002, 0, 36_000 * 4)
    assert shaft.at(math.tau / 360) == 99  # one degree less the part of a raw count
    assert shaft.at(5 * math.tau) == 36_000


@given(st.integers(0, RANGE - 1), st.floats(-20.0, 20.0))
def test_preset_makes_the_present_position_that_value(preset, angle_rad):
    shaft = Shaft(angle_rad)
    shaft.dictionary.write(0x6003, 0, preset.to_bytes(4, "little"))
    assert shaft.encoder.position() == preset
    offset = shaft.dictionary.number(0x6509)
    assert (Shaft().at(angle_rad) + offset - preset) % RANGE == 0


def test_a_preset_beyond_the_range_is_refused():
    shaft = Shaft()
    shaft.dictionary.put(0x6000, 0, 0x5)
    shaft.dictionary.put(0x6002, 0, 1000)
    with pytest.raises(SdoAbort, match="TOO_HIGH"):
        shaft.dictionary.write(0x6003, 0, (1000).to_bytes(4, "little"))
