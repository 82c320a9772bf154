"""Alignment and closed-form starts: exact on exact data, wherever the device stands; a DataError where undetermined."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording.session_folder import read_folder
from calibrate.errors import DataError
from calibrate.fit.instruments import instruments_of
from calibrate.model.alignment import (
    align,
    align_with_tool,
    aligned_difference,
    best_rotation,
    nearest_rotation,
    pivot,
    rigid_motion,
    trilaterate,
)
from calibrate.model.rigid import transform

T_A_B = transform([3.0, -2.0, 1.0], [2.1, -1.4, 0.9])


def seen_from_b(points_m):
    return (points_m - T_A_B[:3, 3]) @ T_A_B[:3, :3]


def flanges(n, seed=0):
    rng = np.random.default_rng(seed)
    return np.array([transform(rng.uniform(-0.5, 0.5, 3), rng.uniform(-2, 2, 3)) for _ in range(n)])


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-0.5, 0.5, (40, 3))


def noisy(points, seed=2):
    return seen_from_b(points) + np.random.default_rng(seed).normal(0.0, 0.01, points.shape)


def test_the_rigid_motion_is_the_one_of_an_independent_implementation(points):
    seen, weight = noisy(points), np.random.default_rng(3).uniform(0.1, 2.0, len(points))
    for given in (None, weight):
        middle_a, middle_b = np.average(points, 0, given), np.average(seen, 0, given)
        turn = Rotation.align_vectors(points - middle_a, seen - middle_b, given)[0]
        found = rigid_motion(points, seen, given)
        assert_allclose(found[:3, :3], turn.as_matrix(), atol=1e-14)
        assert_allclose(found[:3, 3], middle_a - turn.apply(middle_b), atol=1e-14)
        assert_allclose(found[3], [0.0, 0.0, 0.0, 1.0])
    assert_allclose(rigid_motion(points, seen, np.full(len(points), 7.0)), rigid_motion(points, seen), atol=1e-14)


def test_a_row_of_weight_zero_does_not_pull(points):
    seen, weight = seen_from_b(points), np.ones(len(points))
    seen[5] += 30.0
    weight[5] = 0.0
    assert_allclose(rigid_motion(points, seen, weight), T_A_B, atol=1e-12)


def test_points_of_the_other_hand_give_a_rotation_unless_a_mirror_is_asked_for(points):
    seen = seen_from_b(points) * [1.0, -1.0, 1.0]
    plain, mirrored = rigid_motion(points, seen), rigid_motion(points, seen, mirrored=True)
    assert np.linalg.det(plain[:3, :3]) == pytest.approx(1.0)
    assert np.linalg.norm(aligned_difference(points, seen)) > 0.1
    assert np.linalg.det(mirrored[:3, :3]) == pytest.approx(-1.0)
    assert_allclose(seen @ mirrored[:3, :3].T + mirrored[:3, 3], points, atol=1e-12)
    assert_allclose(nearest_rotation(np.diag([1.0, 1.0, -0.1])), np.eye(3), atol=1e-15)


def test_sets_of_points_are_aligned_side_by_side(points):
    seen = np.stack([noisy(points, 4), noisy(points, 5)])
    weight = np.random.default_rng(6).uniform(0.1, 2.0, seen.shape[:-1])
    found = rigid_motion(points, seen, weight)
    assert found.shape == (2, 4, 4)
    for k in range(2):
        assert_allclose(found[k], rigid_motion(points, seen[k], weight[k]), atol=1e-14)


def test_points_on_a_line_leave_the_same_distances_whatever_the_turn_about_it(points):
    line = points[:, :1] * np.array([1.0, 2.0, 3.0])
    assert_allclose(aligned_difference(line, seen_from_b(line)), 0.0, atol=1e-12)


def test_directions_are_turned_and_not_shifted(points):
    assert_allclose(best_rotation(points @ T_A_B[:3, :3].T, points), T_A_B[:3, :3], atol=1e-12)


def test_any_frame_is_found(points):
    found = align(points, seen_from_b(points))
    assert_allclose(found.T_a_b, T_A_B, atol=1e-12)
    assert found.determinant == 1.0
    assert not found.mirrored


def test_bad_shots_do_not_pull_the_start(points):
    seen = seen_from_b(points)
    seen[[3, 17]] += [[1.0, 0, 0], [0, -30.0, 0]]
    found = align(points, seen)
    assert_allclose(found.T_a_b, T_A_B, atol=1e-12)
    assert np.flatnonzero(~found.used).tolist() == [3, 17]


@pytest.mark.parametrize("axis", range(3))
def test_a_mirrored_axis_is_reported(points, axis):
    seen = seen_from_b(points)
    seen[:, axis] *= -1.0
    found = align(points, seen)
    assert found.mirrored
    assert found.mirrored_rms_m < 1e-12 < found.rms_m


def test_points_in_a_plane_tell_no_hand(points):
    points[:, 2] = 0.0
    assert align(points, seen_from_b(points)).determinant == 0.0


def test_points_on_a_line_are_refused(points):
    line = points[:, :1] * np.array([1.0, 2.0, 3.0])
    with pytest.raises(DataError, match="on one line"):
        align(line, seen_from_b(line))


def test_tool_and_frame_are_found_together():
    T, tool = flanges(12), np.array([0.03, -0.1, 0.2])
    found, tool_m = align_with_tool(T, seen_from_b(T[:, :3, :3] @ tool + T[:, :3, 3]))
    assert_allclose(tool_m, tool, atol=1e-11)
    assert_allclose(found.T_a_b, T_A_B, atol=1e-11)


def test_a_probe_in_two_cones_tells_its_tip_and_the_cones():
    tool, cones, seat = np.array([0.03, -0.1, 0.2]), np.array([[0.5, 0, 0.1], [0.2, 0.4, 0.1]]), np.arange(10) % 2
    T = flanges(10)
    T[:, :3, 3] = cones[seat] - T[:, :3, :3] @ tool
    tool_m, found = pivot(T, seat + 1)
    assert_allclose(tool_m, tool, atol=1e-12)
    assert_allclose([found[1], found[2]], cones, atol=1e-12)
    same = Rotation.from_rotvec(np.outer(np.arange(10) * 0.3, [0, 0, 1])).as_matrix()
    T[:, :3, :3] = same  # always about one direction: height of tip and cones trade
    with pytest.raises(DataError, match="leans the same way"):
        pivot(T, seat + 1)


def test_a_drum_is_found_from_lengths_and_refused_in_a_plane(points):
    drum = np.array([2.0, 0.3, -0.4])
    assert_allclose(trilaterate(points, np.linalg.norm(points - drum, axis=1)), drum, atol=1e-11)
    points[:, 1] = 0.2
    with pytest.raises(DataError, match="one plane"):
        trilaterate(points, np.linalg.norm(points - drum, axis=1))


@pytest.mark.parametrize("name", ["ur5-tracker", "ur10-leica-a", "ur10-leica-b", "ur10-leica-d"])
def test_trackers_of_real_recordings_are_found_without_a_start(name):
    folder = Path(__file__).parents[4] / "shared" / "data" / name
    if not folder.is_dir():
        pytest.skip(f"the real recording {name} is not beside the project (../shared/data)")
    recording = read_folder(folder)
    rig = msgspec.structs.replace(recording.rig, device=None)
    found = instruments_of(recording.samples, rig)
    assert found.alignment is not None
    assert found.alignment.determinant == 1.0
    assert found.alignment.rms_m < 5e-3  # what uncalibrated arms of 1 m miss; a wrong frame misses decimetres
    assert found.alignment.mirrored_rms_m > 0.1
    assert len(found.unused) == 0
