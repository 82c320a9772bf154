"""Counts to a continuous angle."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia406.angle import ContinuousAngle, Scale, scale_of

TURN, RANGE = 1 << 20, 1 << 32
MULTI_TURN = Scale(TURN, RANGE, True)
SINGLE_TURN = Scale(TURN, TURN, True)
UNIT_RAD = math.tau / TURN


def test_scale_without_and_with_scaling():
    assert scale_of(0x1, 9, 9, TURN, 4096) == MULTI_TURN
    assert scale_of(0x5, 36_000, 144_000, TURN, 4096) == Scale(36_000, 144_000, True)
    assert scale_of(0x0, 9, 9, TURN, 1).unit_rad == pytest.approx(-UNIT_RAD)


@pytest.mark.parametrize("numbers", [(1, 1, 1, 0, 4096), (5, 0, 100, TURN, 1), (5, 100, 99, TURN, 1)])
def test_a_scale_that_cannot_be_is_refused(numbers):
    with pytest.raises(ValueError, match="units a turn"):
        scale_of(*numbers)


def test_the_first_angle_is_near_zero():
    assert ContinuousAngle(MULTI_TURN).follow(RANGE - 1, 0.0) == pytest.approx(-UNIT_RAD)
    assert ContinuousAngle(MULTI_TURN).follow(TURN, 0.0) == pytest.approx(math.tau)
    assert ContinuousAngle(SINGLE_TURN).follow(TURN * 3 // 4, 0.0) == pytest.approx(-math.tau / 4)


@pytest.mark.parametrize("scale", [MULTI_TURN, SINGLE_TURN, Scale(36_000, 144_000, True)])
@given(start=st.integers(-RANGE, RANGE), steps=st.lists(st.integers(-9000, 9000), min_size=1, max_size=40))
def test_any_walk_in_steps_below_half_the_range_is_followed(scale, start, steps):
    """Differences are those of the walk, however often the position wraps."""
    angle = ContinuousAngle(scale, speed_limit_rad_s=1e9)
    first = angle.follow(start % scale.range_units, 0.0)
    units = start
    for number, step in enumerate(steps, start=1):
        units += step
        found = angle.follow(units % scale.range_units, float(number))
        assert found - first == pytest.approx((units - start) * scale.unit_rad, abs=1e-6)


def test_clockwise_counts_give_counter_clockwise_angles():
    angle = ContinuousAngle(Scale(TURN, RANGE, False))
    assert angle.follow(RANGE - TURN // 4, 0.0) == pytest.approx(math.tau / 4)


def test_a_step_faster_than_any_joint_is_no_motion():
    angle = ContinuousAngle(MULTI_TURN, speed_limit_rad_s=10.0)
    angle.follow(0, 0.0)
    assert math.isnan(angle.follow(TURN // 2, 0.005))
    assert angle.jumps == 1
    assert angle.follow(10, 0.010) == pytest.approx(10 * UNIT_RAD)


def test_a_lasting_step_is_believed_once_it_could_be_motion():
    angle = ContinuousAngle(MULTI_TURN, speed_limit_rad_s=10.0)
    angle.follow(0, 0.0)
    assert math.isnan(angle.follow(TURN // 2, 0.1))
    assert angle.follow(TURN // 2, 0.4) == pytest.approx(math.pi)


def test_a_still_encoder_may_flicker_by_one_count_at_any_rate():
    angle = ContinuousAngle(MULTI_TURN, speed_limit_rad_s=0.0)
    angle.follow(5, 1.0)
    assert angle.follow(6, 1.0) == pytest.approx(6 * UNIT_RAD)
