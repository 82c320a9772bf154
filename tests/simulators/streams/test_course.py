"""How an arm goes through its poses, and what servos and springs make of it: against scipy's own solver."""

import numpy as np
import pytest
from scipy.signal import lsim

from simulators.streams.course import SERVO_HZ, SPEED_RAD_S, STAND_S, STEP_S, Course, course, swung


@pytest.fixture(scope="module")
def way() -> Course:
    return course(np.random.default_rng(4).uniform(-1.0, 1.0, (5, 6)))


def test_it_stands_at_every_pose_and_no_joint_is_too_fast(way: Course) -> None:
    poses = np.random.default_rng(4).uniform(-1.0, 1.0, (5, 6))
    for stop_s, pose in zip(way.stops_s, poses, strict=True):
        standing = (way.time_s > stop_s + STEP_S) & (way.time_s < stop_s + STAND_S - STEP_S)
        assert np.all(way.command_rad[standing] == pose)
    speed = np.abs(np.diff(way.command_rad, axis=0)) / STEP_S
    assert speed.max() < SPEED_RAD_S / 0.75 * 1.001  # of a trapezoid that brakes and speeds up a quarter of its time


def test_shafts_arrive_long_before_a_patient_program_reads(way: Course) -> None:
    for stop_s in way.stops_s:
        k = round((stop_s + 0.3) / STEP_S)
        assert way.q_rad[k] == pytest.approx(way.command_rad[k], abs=1e-9)


@pytest.mark.parametrize(("frequency_hz", "damping"), [(SERVO_HZ, 1.0), (8.0, 0.03)])
def test_a_spring_swings_as_scipy_solves_it(frequency_hz: float, damping: float) -> None:
    u = np.random.default_rng(1).standard_normal((400, 1)).cumsum(axis=0)
    w = 2.0 * np.pi * frequency_hz
    system = ([[0.0, 1.0], [-(w**2), -2.0 * damping * w]], [[0.0], [w**2]], [[1.0, 0.0]], [[0.0]])
    _, solved, _ = lsim(system, u[:, 0], STEP_S * np.arange(400), interp=False)
    assert swung(u, frequency_hz, damping)[:, 0] == pytest.approx(solved, abs=1e-9 * np.abs(solved).max())


def test_time_since_the_last_stop(way: Course) -> None:
    last, since_s = way.since_stop()
    k = round((way.stops_s[2] + 0.25) / STEP_S)
    assert last[k] == 2
    assert since_s[k] == pytest.approx(0.25, abs=2.0 * STEP_S)
