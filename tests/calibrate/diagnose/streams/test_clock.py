"""Clocks of two devices brought together by the motion that both saw."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.stream_cases import drawn_clock, servo_scene
from benchmarks.streams import clock_case, spot_clock_case
from calibrate.diagnose.streams.clock import ClockFit, ClockStatus, clock_between
from calibrate.diagnose.streams.coarse_clock import Ticks

TENTH_MS = 1e-4


@pytest.mark.parametrize("seed", range(1, 5))
def test_encoders_are_brought_to_the_clock_of_the_joints(seed):
    error_s, drift_error, in_sigmas = clock_case(servo_scene, seed)
    assert abs(error_s) < TENTH_MS
    assert abs(drift_error) < 5e-6
    assert abs(in_sigmas) < 5.0


def test_spots_that_are_dark_a_third_of_the_time_tell_their_clock():
    error_s, _, _ = spot_clock_case(1)
    assert abs(error_s) < TENTH_MS


def test_rates_that_differ_eightfold_are_found_from_the_stamps_of_the_host():
    scene = servo_scene(5)
    joints, encoders = scene.joints(), scene.encoders()
    hurried = replace(joints, time_s=8.0 * joints.time_s)
    fit = clock_between(hurried, encoders, Ticks(0.3, 7.0, 0.0))
    assert fit.drift == pytest.approx(7.0, abs=1e-4)
    assert fit.to_reference(np.array([4.0]))[0] == pytest.approx(32.0, abs=1e-3)


def test_an_arm_that_stands_tells_nothing_of_time():
    scene = servo_scene(2)
    joints, encoders = scene.joints(), scene.encoders()
    still = replace(encoders, values=np.broadcast_to(encoders.values[0], encoders.values.shape).copy())
    assert clock_between(joints, still).status is ClockStatus.DOES_NOT_MOVE


def test_another_motion_has_no_common_clock():
    fit = clock_between(servo_scene(1).joints(), servo_scene(2).encoders())
    assert fit.offset_s is None


def test_clocks_without_an_offset_convert_nothing():
    with pytest.raises(ValueError, match="too little motion"):
        ClockFit(ClockStatus.DOES_NOT_MOVE).to_reference(np.zeros(1))


def test_one_outlying_reading_moves_no_clock():
    scene = servo_scene(3)
    clock, own = drawn_clock(scene.rng, scene.encoders())
    own.values[len(own.values) // 2] += 0.5
    fit = clock_between(scene.joints(), own)
    assert abs(fit.offset_s - clock.offset_at(fit.middle_s)) < TENTH_MS
