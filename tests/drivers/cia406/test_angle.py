"""Counts to a continuous angle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia406.codec import ContinuousAngle, Scale, Slip, scale_of

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


def test_a_lasting_step_is_a_slip_and_distinguished_from_there_on():
    angle = ContinuousAngle(MULTI_TURN, speed_limit_rad_s=10.0)
    angle.follow(0, 0.0)
    assert math.isnan(angle.follow(TURN // 2, 0.1))
    assert math.isnan(angle.follow(TURN // 2, 0.11))
    assert angle.follow(TURN // 2, 0.12) == pytest.approx(math.pi)
    assert angle.slips == (Slip(0.1, pytest.approx(math.pi)),)
    assert angle.slip_rad == pytest.approx(math.pi)


def turning(rate_rad_s: float, time_s: float, offset_rad: float = 0.0) -> int:
    return round((rate_rad_s * time_s + offset_rad) / UNIT_RAD) % RANGE


@pytest.mark.parametrize("rate_rad_s", [0.0, 2.0, -2.0])
@pytest.mark.parametrize("slip_rad", [0.15, -0.15])
def test_a_slip_below_the_speed_limit_is_found_by_acceleration(rate_rad_s, slip_rad):
    """0.15 rad in 10 ms is 15 rad/s: any joint limit that allows for it hides it; 20 rad/s^2 does not."""
    angle = ContinuousAngle(MULTI_TURN, acceleration_limit_rad_s2=20.0)
    for n in range(100):
        offset_rad = slip_rad if n >= 50 else 0.0
        found = angle.follow(turning(rate_rad_s, 0.01 * n, offset_rad), 0.01 * n)
        assert math.isnan(found) == (n in (50, 51))
    assert angle.slips == (Slip(pytest.approx(0.5), pytest.approx(slip_rad, abs=3 * UNIT_RAD)),)


def test_motion_within_the_limit_is_no_slip_however_late_the_host_is():
    """Starts, stops and turns at 10 rad/s^2 against a limit of 20, with host times off by up to 1 ms."""
    rng = np.random.default_rng(2)
    angle = ContinuousAngle(MULTI_TURN, acceleration_limit_rad_s2=20.0)
    position_rad = speed_rad_s = 0.0
    for n in range(3000):
        speed_rad_s = float(np.clip(speed_rad_s + 0.01 * rng.uniform(-10.0, 10.0), -2.0, 2.0))
        position_rad += 0.01 * speed_rad_s
        angle.follow(round(position_rad / UNIT_RAD) % RANGE, 0.01 * n + rng.uniform(-0.001, 0.001))
    assert angle.slips == ()
    assert angle.jumps == 0


def test_a_glitch_is_no_slip():
    angle = ContinuousAngle(MULTI_TURN, acceleration_limit_rad_s2=20.0)
    found = [angle.follow(TURN // 8 if n in (7, 20, 21) else 5, 0.01 * n) for n in range(40)]
    assert [n for n, each in enumerate(found) if math.isnan(each)] == [7, 20, 21]
    assert angle.slips == ()


def test_ends_of_the_range_are_counted():
    angle = ContinuousAngle(SINGLE_TURN)
    for n in range(100):
        angle.follow(n * TURN // 10 % TURN, 0.1 * n)
    assert angle.wraps == 9


def test_a_still_encoder_may_flicker_by_one_count_at_any_rate():
    angle = ContinuousAngle(MULTI_TURN, speed_limit_rad_s=0.0)
    angle.follow(5, 1.0)
    assert angle.follow(6, 1.0) == pytest.approx(6 * UNIT_RAD)


def test_readings_that_a_busy_host_takes_in_one_go_are_motion() -> None:
    """Sent every 10 ms by a shaft at 1 rad/s, heard 50 us apart after a pause."""
    angle = ContinuousAngle(Scale(1 << 20, 1 << 32, True))
    unit_rad = angle.follow(1, 0.0)
    heard = [angle.follow(round(0.01 * number / unit_rad), 0.05 + 5e-5 * number) for number in range(1, 6)]
    assert heard == pytest.approx([0.01 * number for number in range(1, 6)], abs=unit_rad)
    assert angle.slips == ()
