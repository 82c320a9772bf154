"""A file written by another convention is named by that convention, and a right one is left alone."""

import numpy as np
import pytest

from calibrate.fit.gross_errors.conventions import wrong_convention
from calibrate.fit.gross_errors.joint_hypotheses import beyond_limits
from calibrate.model.checks.gross_error import GrossErrorKind
from calibrate.model.checks.rough_fit import rough_fit
from calibrate.model.sensors.position import PositionWitness
from tests.calibrate.fit.gross_errors.conftest import POINT, flange


def judged(q, position_m, point_m=POINT):
    return wrong_convention(flange, [PositionWitness(q, position_m, point_m)])


def turned(q, joint, by):
    out = q.copy()
    out[:, joint - 1] += by
    return out


def reversed_joint(q, joint):
    out = q.copy()
    out[:, joint - 1] *= -1.0
    return out


def coupled(q, joint, sign):
    return turned(q, joint, sign * q[:, joint - 2])


def test_an_arm_a_few_millimetres_off_its_drawing_is_no_gross_error(scene):
    assert judged(scene.q_rad, scene.position_m) is None
    assert judged(scene.q_rad, scene.position_m, None) is None


# Daily for the other joints: any set of joints, in test_joint_signs.py.
@pytest.mark.parametrize("joint", [1, 3, *(pytest.param(joint, marks=pytest.mark.endure) for joint in (2, 4, 5, 6))])
def test_a_joint_counted_the_other_way_round_is_named(scene, joint):
    found = judged(reversed_joint(scene.q_rad, joint), scene.position_m)
    assert found.kind is GrossErrorKind.JOINT_SIGN
    assert found.whole_file
    assert f"column q{joint}_rad" in found.says


QUARTERS = [(2, 1), (3, 2), (4, -1)]
MORE = [(5, 1), (6, 2), (2, -1)]  # daily: quarters of either sign and a half, above


@pytest.mark.parametrize(
    ("joint", "quarters"), [*QUARTERS, *(pytest.param(*one, marks=pytest.mark.endure) for one in MORE)]
)
def test_a_zero_off_by_quarters_of_a_turn_is_named_with_what_to_add(scene, joint, quarters):
    found = judged(turned(scene.q_rad, joint, quarters * np.pi / 2), scene.position_m)
    assert f"q{joint}_rad" in found.says
    assert f"zero of joint {joint} is" in found.says


def test_the_sense_of_a_quarter_turn_is_the_one_to_add(scene):
    found = judged(turned(scene.q_rad, 4, np.pi / 2), scene.position_m)
    assert (found.kind, found.remedy.split(" to ")[0]) == (GrossErrorKind.JOINT_OFFSET, "add -1.570796 rad")


@pytest.mark.parametrize("joint", [2, 3, 4])
@pytest.mark.parametrize(("sign", "remedy"), [(1.0, -1.0), (-1.0, 1.0)])
def test_an_angle_counted_from_another_link_is_named(scene, joint, sign, remedy):
    found = judged(coupled(scene.q_rad, joint, sign), scene.position_m)
    assert found.kind is GrossErrorKind.JOINT_COUPLING
    assert f"joint {joint} is coupled with joint {joint - 1}" in found.says
    assert f"write follows = {{ joint = {joint - 1}, by = {remedy} }} for joint {joint}" in found.remedy
    assert ("FANUC" in found.remedy) is (joint == 3)


@pytest.mark.parametrize("mirror", [[-1, 1, 1], [1, -1, 1], [1, 1, -1]])
def test_a_mirrored_axis_of_the_device_is_reported_by_the_determinant(scene, mirror):
    found = judged(scene.q_rad, scene.position_m * mirror)
    assert found.kind is GrossErrorKind.MIRRORED_AXIS
    assert "determinant -1" in found.says


def test_two_exchanged_columns_are_a_mirror_too(scene):
    found = judged(scene.q_rad, scene.position_m[:, [1, 0, 2]])
    assert found.kind is GrossErrorKind.MIRRORED_AXIS


def test_degrees_beyond_the_limits_are_seen_without_any_instrument(scene):
    limits = np.tile([-2.9, 2.9], (6, 1))
    assert beyond_limits(scene.q_rad, limits) is None
    found = beyond_limits(np.degrees(scene.q_rad), limits)
    assert found.kind is GrossErrorKind.DEGREES
    assert "degrees" in found.says


def test_one_typed_digit_is_not_a_unit(scene):
    scene.q_rad[7, 2] = 150.0
    assert beyond_limits(scene.q_rad, np.tile([-2.9, 2.9], (6, 1))) is None


def test_a_small_motion_in_degrees_is_found_by_the_positions(scene):
    q = scene.q_rad / 40.0  # degrees of these lie within the limits of many arms
    found = judged(np.degrees(q), scene.expect(q))
    assert found.kind is GrossErrorKind.DEGREES


def test_one_column_in_degrees_is_named_alone(scene):
    q = scene.q_rad.copy()
    q[:, 3] = np.degrees(q[:, 3])
    found = judged(q, scene.position_m)
    assert (found.kind, found.column) == (GrossErrorKind.DEGREES, "column q4_rad")


def test_outlying_rows_do_not_hide_the_convention(scene):
    scene.position_m[::7] += 3.0
    found = judged(reversed_joint(scene.q_rad, 3), scene.position_m)
    assert found.kind is GrossErrorKind.JOINT_SIGN


def test_frame_and_target_of_a_perfect_arm_are_found_exactly(scene):
    T = flange(scene.q_rad)
    positions = scene.turn.apply(T[:, :3, :3] @ POINT + T[:, :3, 3]) + scene.shift_m
    found = rough_fit(T, positions, np.zeros(3))
    np.testing.assert_allclose(found.linear, scene.turn.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(found.point_m, POINT, atol=1e-6)
    assert found.typical_m < 1e-6
