"""Closed-form starts: exact on exact data, wherever the device stands, and loud where the data cannot tell."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording.session_folder import read_folder
from calibrate.alignment import align, align_with_tool, pivot, trilaterate
from calibrate.errors import DataError
from calibrate.instruments import instruments_of
from calibrate.rigid import transform

T_A_B = transform([3.0, -2.0, 1.0], [2.1, -1.4, 0.9])


def seen_from_b(points_m):
    return (points_m - T_A_B[:3, 3]) @ T_A_B[:3, :3]


def flanges(n, seed=0):
    rng = np.random.default_rng(seed)
    return np.array([transform(rng.uniform(-0.5, 0.5, 3), rng.uniform(-2, 2, 3)) for _ in range(n)])


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-0.5, 0.5, (40, 3))


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
def test_a_mirrored_axis_is_told(points, axis):
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
    folder = Path(__file__).parents[3] / "shared" / "data" / name
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
