"""A tool found from single-axis rotations, by axis lines and by the fit of the wrist, in an unknown tracker frame."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import Arm, ArmModel, Joint, Rig
from calibrate.errors import DataError
from calibrate.fit.solvers import Status
from calibrate.model.arms.catalogue import arm_of
from calibrate.tool_axes.arm_prior import assumed_prior
from calibrate.tool_axes.circle import single_axis_segments
from calibrate.tool_axes.tool import calibrate_tool
from calibrate.tool_axes.wrist_fit import TargetRows

TOOL = np.array([0.035, -0.02, 0.11])
HOME = np.array([0.3, -1.2, 1.4, -0.4, 1.2, 0.5])
TURN, SHIFT = Rotation.from_rotvec([0.4, -1.3, 2.0]), np.array([2.0, -1.0, 0.7])


def turns(*joints, steps=15, span=1.6):
    """Readings at home, then each joint turned alone to and fro about it."""
    rows = [HOME]
    for joint in joints:
        for angle in np.linspace(-span, span, steps):
            q = HOME.copy()
            q[joint - 1] += angle
            rows.append(q)
    return np.array(rows)


def calibrated(arm, q_rad, position_m, file_rows=None, zero_sigma_rad=0.0):
    """Of an arm that is taken as exact, or whose zeros are not."""
    rows = TargetRows(q_rad, position_m, None, file_rows)
    return calibrate_tool(arm, (rows,), assumed_prior(arm, zero_sigma_rad))


@pytest.fixture
def arm(ur5e_exact):
    links = ur5e_exact().links
    joints = tuple(
        Joint(-6.3, 6.3, a_m=a, alpha_rad=alpha, d_m=d, theta_offset_rad=0.0) for d, a, alpha, _ in links.tolist()
    )
    return arm_of(Rig(1, "ur5e", Arm(ArmModel.DH, joints)))


@pytest.fixture
def positions(ur5e_exact):
    truth = ur5e_exact()

    def measure(q_rad, noise_m=0.0, seed=1):
        tips = np.array([(truth.flange(q) @ np.array([*TOOL, 1.0]))[:3] for q in q_rad])
        return TURN.apply(tips) + SHIFT + np.random.default_rng(seed).normal(0, noise_m, tips.shape)

    return measure


def test_segments_are_found_from_the_readings_alone():
    q = turns(4, 5, 6) + np.random.default_rng(0).normal(0, 1e-5, (46, 6))
    segments = single_axis_segments(q)
    assert [s.joint for s in segments] == [4, 5, 6]
    assert [len(s.rows) for s in segments] == pytest.approx([15, 15, 15], abs=1)


def test_free_motion_has_no_segments():
    assert single_axis_segments(np.random.default_rng(2).uniform(-1, 1, (40, 6))) == ()


def test_exact_data_give_the_tool_exactly_by_lines_and_by_the_fit(arm, positions):
    q = turns(4, 5, 6)
    found = calibrated(arm, q, positions(q))
    assert found.status is Status.CONVERGED
    assert_allclose(found.targets[0].by_axes_m, TOOL, atol=1e-8)
    assert_allclose(found.targets[0].point_m, TOOL, atol=1e-8)


def test_axis_lines_are_those_of_the_arm_in_the_tracker_s_frame(arm, positions, ur5e_exact):
    q = turns(5, 6)
    found = calibrated(arm, q, positions(q))
    T = ur5e_exact().flange(found.flange.q_rad)
    assert_allclose(found.flange.T_device_flange[:3, :3], TURN.as_matrix() @ T[:3, :3], atol=1e-8)
    assert_allclose(found.flange.T_device_flange[:3, 3], TURN.apply(T[:3, 3]) + SHIFT, atol=1e-8)


def test_with_noise_the_errors_are_as_large_as_stated(arm, positions):
    q = turns(4, 5, 6)
    errors, flange = [], []
    truth = calibrated(arm, q, positions(q)).flange.T_device_flange
    for seed in range(15):
        found = calibrated(arm, q, positions(q, 20e-6, seed))
        errors.append((found.targets[0].point_m - TOOL) / found.targets[0].sigma_m)
        flange.append((found.flange.T_device_flange[:3, 3] - truth[:3, 3]) / found.flange.origin_sigma_m)
    assert 0.75 < np.sqrt(np.mean(np.square(errors))) < 1.3
    assert 0.75 < np.sqrt(np.mean(np.square(flange))) < 1.3


def test_the_wrist_s_last_joint_alone_is_not_enough(arm, positions):
    q = turns(4, 6)
    with pytest.raises(DataError, match="joint 5 alone and 6 alone are needed") as lines:
        calibrated(arm, q, positions(q))
    assert str(lines.value).endswith("found single rotations of joint 4 (rows 1-16), 6 (rows 17-31)")


def test_an_arc_that_is_too_short_is_reported_with_its_rows(arm, positions):
    q = np.concatenate([turns(6), turns(5, span=0.1)])
    with pytest.raises(DataError, match=r"joint 5 alone turns only 11\.5° .*; 20° and 5 rows are needed"):
        calibrated(arm, q, positions(q))


def test_a_joint_that_was_moved_between_both_rotations_is_named(arm, positions):
    q = turns(5, 6)
    q[16:, 1] += 0.1
    with pytest.raises(DataError, match=r"joint 2 stands 5\.7° apart between rows 1-16 and rows 17-31"):
        calibrated(arm, q, positions(q))


def test_errors_count_rows_as_the_file_does(arm, positions):
    q = turns(4, 6)
    with pytest.raises(DataError, match=r"found single rotations of joint 4 \(rows 11-26\)"):
        calibrated(arm, q, positions(q), np.arange(10, 10 + len(q)))
