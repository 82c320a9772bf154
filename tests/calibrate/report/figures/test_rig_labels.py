"""Numbered discs of joints that lie one behind the other stand side by side."""

import numpy as np
import pytest

from calibrate.report.figures.rig_figures import spread

NOTHING = np.zeros((0, 2))


def gaps(points):
    return np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(len(points), 1)]


@pytest.mark.parametrize("seed", range(5))
def test_points_come_apart_and_stay_near(seed):
    points = np.random.default_rng(seed).normal(0.0, 0.3, (7, 2))
    points[3] = points[2]  # two joints seen along the line between them
    moved = spread(points, NOTHING, 0.2)
    assert gaps(moved).min() >= 0.2 * (1.0 - 1e-9)
    assert np.linalg.norm(moved - points, axis=1).max() < 1.0


def test_what_is_fixed_does_not_give_way_and_what_is_apart_does_not_move():
    points, fixed = np.array([[0.0, 0.0], [5.0, 5.0]]), np.array([[0.05, 0.0]])
    moved = spread(points, fixed, 0.2)
    assert np.linalg.norm(moved[0] - fixed[0]) >= 0.2
    assert moved[1].tolist() == [5.0, 5.0]
