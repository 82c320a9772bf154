"""What makes a motion clear, and when the gate of a rig takes it."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.errors import RefusedMotionError
from acquisition.recording.motion_plan import JointSeries, MotionPlan
from acquisition.recording.rig import load_rig
from calibeam.motion.exciting_motion import check_motion, clear_motion

RIG = load_rig(Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml")
HOME_RAD = np.array(RIG.motion.home_rad)


def motion(amplitude_rad: float, length_s: float = 10.0) -> MotionPlan:
    series = (JointSeries(q, (0.0, 0.0), (amplitude_rad, -amplitude_rad / 4.0)) for q in HOME_RAD.tolist())
    return MotionPlan(1, RIG.name, length_s, 1, tuple(series))


def test_a_small_motion_about_home_is_clear_and_driven_as_it_is() -> None:
    small = motion(0.05)
    assert clear_motion(RIG)(small.at(np.arange(0.0, 10.0, 0.05)), 0.05)
    check_motion(RIG, small)


def test_a_motion_that_is_too_fast_is_refused_not_stretched() -> None:
    with pytest.raises(RefusedMotionError, match=r"has 8\.\d+ times the acceleration"):
        check_motion(RIG, motion(0.05, length_s=0.4))


def test_a_way_through_a_box_is_not_clear_and_refused() -> None:
    (table, *_) = RIG.motion.keep_out
    low = msgspec.structs.replace(table, upper_m=(1.2, 1.2, 0.6))
    walled = msgspec.structs.replace(RIG, motion=msgspec.structs.replace(RIG.motion, keep_out=(low,)))
    assert not clear_motion(walled)(motion(0.05).at(np.arange(0.0, 10.0, 0.05)), 0.05)


def test_a_wrist_at_the_upper_arm_is_not_clear() -> None:
    folded = np.array([0.3, -1.4, 2.7, -0.5, 0.5, 0.0])
    free = msgspec.structs.replace(RIG, motion=msgspec.structs.replace(RIG.motion, keep_out=(), slow_area=()))
    clear = clear_motion(free)
    assert clear(np.tile(HOME_RAD, (3, 1)), 0.05)
    assert not clear(np.tile(folded, (3, 1)), 0.05)


def test_a_slow_area_counts() -> None:
    fast = motion(0.12, length_s=4.0).at(np.arange(0.0, 4.0, 0.05))
    free = msgspec.structs.replace(RIG, motion=msgspec.structs.replace(RIG.motion, keep_out=(), slow_area=()))
    assert clear_motion(free)(fast, 0.05)
    everywhere = msgspec.structs.replace(
        RIG.motion.slow_area[0], lower_m=(-2.0, -2.0, -2.0), upper_m=(2.0, 2.0, 2.0), speed_m_s=0.01
    )
    slow = msgspec.structs.replace(free, motion=msgspec.structs.replace(free.motion, slow_area=(everywhere,)))
    assert not clear_motion(slow)(fast, 0.05)


def test_a_wave_between_the_samples_of_a_plan_is_refused() -> None:
    """25 Hz: differences of samples 20 ms apart see nothing of it."""
    cosine = np.zeros(50)
    cosine[[24, 25]] = -0.00217, 0.002006361  # sum of k squared times the k-th amplitude: 0
    series = tuple(JointSeries(q, (0.0,) * 50, tuple(cosine.tolist())) for q in HOME_RAD.tolist())
    with pytest.raises(RefusedMotionError, match=r"times the \w+ that \[motion\]"):
        check_motion(RIG, MotionPlan(1, RIG.name, 1.0, 1, series))


def test_a_motion_that_brings_the_wrist_to_the_upper_arm_is_refused_at_the_robot_too() -> None:
    free = msgspec.structs.replace(RIG, motion=msgspec.structs.replace(RIG.motion, keep_out=(), slow_area=()))
    folded = (0.3, -1.4, 2.7, -0.5, 0.5, 0.0)
    series = tuple(JointSeries(q, (0.0, 0.0), (0.05, -0.0125)) for q in folded)
    with pytest.raises(RefusedMotionError, match="'exciting motion' is not clear"):
        check_motion(free, MotionPlan(1, RIG.name, 10.0, 1, series))
