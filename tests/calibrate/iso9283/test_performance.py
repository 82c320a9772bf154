"""Figures of ISO 9283 of clouds whose answer is known, and the cube."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calibrate.iso9283.cube import cube_corners_m, cube_poses_m
from calibrate.iso9283.performance import (
    MOST_PARTS,
    AttainedPoses,
    distance_accuracy,
    distance_repeatability,
    jackknifed,
    performance_of,
    pose_accuracy,
    pose_accuracy_variation,
    pose_repeatability,
)

COMMAND_M = np.array([0.5, -0.2, 0.4])
OFFSET_M = np.array([3e-4, -4e-4, 1.2e-3])  # 1.3 mm long
SIGMA_M = 2e-5
# Distances from the middle of a round Gaussian cloud follow Maxwell's law: mean and standard deviation over sigma.
MAXWELL_MEAN, MAXWELL_DEVIATION = 2.0 * np.sqrt(2.0 / np.pi), np.sqrt(3.0 - 8.0 / np.pi)
RP_OVER_SIGMA = MAXWELL_MEAN + 3.0 * MAXWELL_DEVIATION  # 3.616


def cloud(count, seed=1, sigma_m=SIGMA_M):
    return COMMAND_M + OFFSET_M + np.random.default_rng(seed).normal(0.0, sigma_m, (count, 3))


def attained(pose, position_m, command_m, side=None, turn_rad=None):
    n = len(pose)
    side = np.zeros(n, dtype=int) if side is None else np.asarray(side)
    return AttainedPoses(np.asarray(pose), side, 60.0 * np.arange(n), command_m, position_m, turn_rad)


def test_a_pure_offset_is_all_accuracy_and_no_scatter():
    off = np.tile(COMMAND_M + OFFSET_M, (30, 1))
    one = performance_of(attained(np.ones(30, dtype=int), off, np.tile(COMMAND_M, (30, 1)))).poses[0]
    assert one.accuracy_m.value == pytest.approx(1.3e-3)
    assert (one.accuracy_m.sigma, one.repeatability_m.value) == pytest.approx((0.0, 0.0), abs=1e-15)


def test_repeatability_of_a_gaussian_cloud_is_in_maxwells_ratio():
    assert pose_repeatability(cloud(200_000)) == pytest.approx(RP_OVER_SIGMA * SIGMA_M, rel=0.01)


def test_repeatability_by_hand():
    """Four points at 1, 1, 1, 3 mm from their middle: l 1.5 mm, S 1 mm."""
    points = 1e-3 * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=float)
    assert pose_repeatability(points) == pytest.approx(1e-3)
    axis = 1e-3 * np.array([[-3.0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 0, 0]])
    assert pose_repeatability(axis) == pytest.approx(1.5e-3 + 3.0 * 1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_scatter_and_distances_do_not_depend_on_the_frame(seed):
    rng = np.random.default_rng(seed)
    a, b = cloud(30, seed), cloud(30, seed + 50) + np.array([0.3, 0.1, 0.0])
    turn, shift = Rotation.random(rng=rng), rng.normal(size=3)
    a2, b2 = turn.apply(a) + shift, turn.apply(b) + shift
    assert pose_repeatability(a2) == pytest.approx(pose_repeatability(a), rel=1e-9)
    assert distance_accuracy(a2, b2, 0.3) == pytest.approx(distance_accuracy(a, b, 0.3), abs=1e-12)
    assert distance_repeatability(a2, b2) == pytest.approx(distance_repeatability(a, b), rel=1e-6)
    assert pose_accuracy_variation(a2, b2) == pytest.approx(pose_accuracy_variation(a, b), rel=1e-9)


def test_one_sigma_is_the_scatter_of_repeated_tests():
    """The jackknife of single tests, against the scatter of 60 of them; of AP the mean along the offset."""
    commands = np.tile(COMMAND_M, (30, 1))
    tests = [performance_of(attained(np.ones(30, int), cloud(30, k), commands)).poses[0] for k in range(60)]
    for name in ("accuracy_m", "repeatability_m"):
        figures = [getattr(one, name) for one in tests]
        scatter = np.std([one.value for one in figures], ddof=1)
        assert np.mean([one.sigma for one in figures]) == pytest.approx(scatter, rel=0.25)
    assert np.std([one.accuracy_m.value for one in tests]) == pytest.approx(SIGMA_M / np.sqrt(30), rel=0.25)


def test_a_scale_error_is_a_distance_error():
    rng = np.random.default_rng(2)
    wanted = cube_poses_m(COMMAND_M, 0.4, "x+")
    pose = np.tile([5, 4, 3, 2, 1], 30)
    command_m = wanted[pose - 1]
    found = performance_of(attained(pose, 1.002 * command_m + rng.normal(0.0, 1e-6, command_m.shape), command_m))
    distance = found.distance
    assert distance.poses == (2, 4)
    assert distance.command_m == pytest.approx(0.8 * np.sqrt(3.0) * 0.4)
    assert distance.accuracy_m.value == pytest.approx(0.002 * distance.command_m, abs=1e-6)
    assert distance.repeatability_m.value == pytest.approx(3.0 * np.sqrt(2.0) * 1e-6, rel=0.4)


def test_distance_error_has_a_sign():
    assert distance_accuracy(np.zeros((3, 3)), np.tile([0.1, 0, 0], (3, 1)), 0.101) == pytest.approx(-1e-3)


def test_backlash_is_in_the_variation_and_not_in_the_scatter():
    pose, side = np.ones(60, dtype=int), np.repeat([0, 1], 30)
    play = np.where(side[:, None] == 1, [5e-5, 0.0, 0.0], 0.0)
    one = performance_of(attained(pose, COMMAND_M + play, np.tile(COMMAND_M, (60, 1)), side)).poses[0]
    assert one.cycles == 30
    assert one.repeatability_m.value == pytest.approx(0.0, abs=1e-15)
    assert (one.sides, one.variation_m.value) == (2, pytest.approx(5e-5))


def test_drift_is_the_way_from_the_first_ten_cycles():
    """5 µm further off along the error in every set of ten."""
    rng = np.random.default_rng(3)
    steps = np.repeat(np.arange(3), 10)[:, None] * np.array([0.0, 0.0, 5e-6])
    command_m = np.tile(COMMAND_M, (30, 1))
    position_m = command_m + np.array([0.0, 0.0, 1e-3]) + steps + rng.normal(0.0, 1e-8, (30, 3))
    drift = performance_of(attained(np.ones(30, dtype=int), position_m, command_m)).drift
    assert drift.after_s == pytest.approx((0.0, 600.0, 1200.0))
    assert drift.dap_m.value == pytest.approx(1e-5, rel=0.01)
    assert drift.moved_m.value == pytest.approx(1e-5, rel=0.01)
    assert drift.drp_m.value < 1e-7


def test_angles_have_their_mean_and_three_deviations():
    turn = np.tile([1e-3, -2e-3, 0.0], (4, 1)) + 1e-4 * np.array([[1, 0, 0], [-1, 0, 0], [1, 0, 0], [-1, 0, 0]])
    command_m = np.tile(COMMAND_M, (4, 1))
    one = performance_of(attained(np.ones(4, dtype=int), command_m, command_m, turn_rad=turn)).poses[0]
    assert [round(a.value, 12) for a in one.turn_rad] == [1e-3, -2e-3, 0.0]
    assert one.turn_repeatability_rad[0].value == pytest.approx(3e-4 * np.sqrt(4.0 / 3.0))


def test_what_was_attained_once_has_no_figure():
    found = performance_of(attained([1, 2], np.zeros((2, 3)), np.zeros((2, 3))))
    assert (found.poses, found.distance, found.drift) == ((), None, None)


def test_two_cycles_have_no_sigma():
    one = performance_of(attained([1, 1], cloud(2), np.tile(COMMAND_M, (2, 1)))).poses[0]
    assert np.isnan(one.repeatability_m.sigma)
    assert np.isfinite(one.repeatability_m.value)


@pytest.mark.parametrize("plane", ["x+", "x-", "y+", "y-"])
def test_the_poses_lie_in_a_diagonal_plane_of_the_cube(plane):
    poses, corners = cube_poses_m(COMMAND_M, 0.5, plane), cube_corners_m(COMMAND_M, 0.5)
    assert np.linalg.matrix_rank(poses[1:] - poses[0], tol=1e-9) == 2
    for pose, other in zip(poses[1:], poses[[3, 4, 1, 2]], strict=True):
        end = corners[np.argmin(np.linalg.norm(corners - pose, axis=1))]
        diagonal = np.linalg.norm(pose - other) / 0.8
        assert diagonal == pytest.approx(0.5 * np.sqrt(3.0))
        assert np.linalg.norm(end - pose) == pytest.approx(0.1 * diagonal)


def test_pose_accuracy_is_of_barycentres():
    assert pose_accuracy(np.array([[1e-3, 0, 0], [-1e-3, 0, 0]]), np.zeros((2, 3))) == pytest.approx(0.0, abs=1e-18)


def test_the_work_for_a_sigma_does_not_grow_with_the_square_of_the_cycles():
    calls, values = [], np.random.default_rng(3).normal(0.0, 1.0, 5 * MOST_PARTS + 7)

    def mean(one):
        calls.append(len(one))
        return float(np.mean(one))

    found = jackknifed(mean, [values])
    assert len(calls) == MOST_PARTS + 1
    assert sum(len(values) - left for left in calls[:-1]) == len(values)  # each is left out once
    assert found.sigma == pytest.approx(np.std(values) / np.sqrt(len(values)), rel=0.1)
