"""Rows of two sessions of one motion find each other by pose and order."""

import tracemalloc

import numpy as np
import pytest

from acquisition.recording import Samples
from calibrate.compare.matched import (
    MOST_ROWS,
    SAME_RAD,
    match,
    zeros_between,
)
from calibrate.errors import DataError


def session(q_rad, **columns):
    q = np.asarray(q_rad, dtype=float)
    joints = {f"q{i + 1}_rad": q[:, i] for i in range(q.shape[1])}
    return Samples({"t_s": np.arange(len(q), dtype=float), **joints, **columns}, q.shape[1])


@pytest.fixture
def poses():
    return np.random.default_rng(1).uniform(-1.0, 1.0, (40, 3))


def test_rows_missing_on_either_side_are_reported(poses):
    one, two = np.delete(poses, [4, 5], axis=0), np.delete(poses, [20], axis=0)
    found = match(session(one), session(two))
    assert np.array_equal(one[found.measured], two[found.simulated])
    assert len(found.measured) == 37
    assert found.only_measured.tolist() == [18]
    assert found.only_simulated.tolist() == [4, 5]


def test_a_pose_taken_twice_keeps_its_order(poses):
    both = np.concatenate([poses[:5], poses[:5]])
    found = match(session(both), session(both))
    assert found.measured.tolist() == found.simulated.tolist() == list(range(10))


def test_another_placement_is_another_sample(poses):
    one, two = session(poses, placement=np.ones(40)), session(poses, placement=np.full(40, 2.0))
    with pytest.raises(DataError, match="same motion"):
        match(one, two)


def test_a_servo_that_stopped_a_little_at_another_place_is_the_same_pose(poses):
    found = match(session(poses + 0.4 * SAME_RAD), session(poses))
    assert len(found.measured) == 40


def test_arms_of_other_joints_are_refused(poses):
    with pytest.raises(DataError, match="2 joints"):
        match(session(poses), session(poses[:, :2]))


def test_the_place_in_the_plan_decides_whatever_the_joints_read(poses):
    """Taken in another order, one twice, one not at all, and every joint from another zero."""
    order = [3, 1, 2, 2, 0]
    plan = [("pose", i) for i in range(5)]
    found = match(session(poses[:5]), session(poses[order] + 2.6), (plan, [plan[i] for i in order]))
    assert found.measured.tolist() == [0, 1, 2, 3]
    assert found.simulated.tolist() == [4, 1, 2, 0]
    assert found.only_measured.tolist() == [4]
    assert found.only_simulated.tolist() == [3]


def test_other_zeros_of_degrees_do_not_break_a_match_of_rows(poses):
    zero_rad = np.array([0.0, -2.6, 0.0])
    measured, simulated = session(poses + zero_rad), session(poses + 1e-3 * np.sin(np.arange(40.0))[:, None])
    found = match(measured, simulated)
    assert found.measured.tolist() == found.simulated.tolist() == list(range(40))
    assert zeros_between(measured, simulated) == pytest.approx(zero_rad, abs=2e-3)


def test_a_servo_moves_no_zero(poses):
    moved = session(poses + 4e-3)
    assert np.array_equal(zeros_between(moved, session(poses)), np.zeros(3))


def test_rows_that_are_found_by_joints_are_bounded(poses):
    many = session(np.tile(poses, (MOST_ROWS // len(poses) + 1, 1)))
    with pytest.raises(DataError, match=f"simulated: {len(many)} rows, .*at most {MOST_ROWS}: compare a part"):
        match(session(poses), many)
    assert len(match(many, many).measured) == len(many)  # row by row as they stand: any number


def test_finding_rows_by_joints_takes_no_more_than_three_numbers_a_pair():
    q = np.random.default_rng(2).uniform(-1.0, 1.0, (1000, 6))
    tracemalloc.start()
    assert len(match(session(q[1:]), session(q)).measured) == 999
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3 * 8 * 1000**2
