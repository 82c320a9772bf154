"""Points that poses share: one set of shifts for all poses of a point, idle where no pose has it."""

import numpy as np
import pytest

from calibrate.errors import DataError
from calibrate.model.placement import SharedPoints

START_M = {2: np.array([1.0, 2.0, 3.0]), 7: np.array([4.0, 5.0, 6.0])}
SHIFTS_M = np.array([0.1, 0.2, 0.3, -0.1, -0.2, -0.3])


def test_poses_of_a_point_are_shifted_together():
    points = SharedPoints("seat", START_M, np.array([7, 2, 7]), 0.05)
    assert [p.name for p in points.parameters] == [f"seat{k}.{a}" for k in (2, 7) for a in "xyz"]
    np.testing.assert_allclose(points.at_poses_m(SHIFTS_M), [[3.9, 4.8, 5.7], [1.1, 2.2, 3.3], [3.9, 4.8, 5.7]])
    steps = 1e-6 * np.eye(6)
    numeric = [(points.at_poses_m(SHIFTS_M + h) - points.at_poses_m(SHIFTS_M - h)) / 2e-6 for h in steps]
    by_point = np.broadcast_to(np.eye(3), (3, 3, 3))
    np.testing.assert_allclose(points.by_shift(by_point), np.stack(numeric, axis=2), atol=1e-9)


def test_a_point_without_poses_is_held():
    points = SharedPoints("point", START_M, np.array([2]), 0.05)
    assert [p.free for p in points.parameters] == [True] * 3 + [False] * 3


def test_a_pose_at_a_point_that_nobody_knows_is_refused():
    with pytest.raises(DataError, match="seat 3 has no start point; give one for every seat of the data"):
        SharedPoints("seat", START_M, np.array([2, 3]), 0.05)
