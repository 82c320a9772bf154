"""Every convention against scipy's rotations, which share nothing with ours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from acquisition.recording.foreign import rotations

ANGLES = arrays(np.float64, (4, 3), elements=st.floats(-3.2, 3.2))
EXACT = {"rtol": 0.0, "atol": 2e-12}


def same(vector_rad, expected):
    """As rotations: at half a turn two vectors are one rotation."""
    apart = (Rotation.from_rotvec(vector_rad) * expected.inv()).magnitude()
    np.testing.assert_allclose(apart, 0.0, **EXACT)
    assert np.all(np.linalg.norm(vector_rad, axis=1) <= np.pi + 1e-12)


@given(ANGLES)
def test_abc_are_turns_about_z_the_new_y_and_the_newest_x(angles):
    same(rotations.of_abc(angles), Rotation.from_euler("ZYX", angles))


@given(ANGLES)
def test_wpr_are_turns_about_fixed_axes(angles):
    same(rotations.of_wpr(angles), Rotation.from_euler("xyz", angles))


@given(ANGLES)
def test_rotation_vectors_of_more_than_half_a_turn_are_shortened(vector_rad):
    same(rotations.of_vectors(2.0 * vector_rad), Rotation.from_rotvec(2.0 * vector_rad))


@given(st.integers(0, 2**31))
def test_quaternions_of_both_orders_and_signs(seed):
    expected = Rotation.random(5, random_state=seed)
    xyzw = expected.as_quat() * np.random.default_rng(seed).choice([-1.0, 1.0], (5, 1))
    same(rotations.of_xyzw(xyzw), expected)
    same(rotations.of_wxyz(np.roll(xyzw, 1, axis=1)), expected)


@given(st.integers(0, 2**31))
def test_matrices(seed):
    expected = Rotation.random(5, random_state=seed)
    same(rotations.of_matrices(expected.as_matrix().reshape(-1, 9)), expected)


@pytest.mark.parametrize("axis", range(3))
def test_matrices_of_half_a_turn(axis):
    vector = np.pi * np.eye(3)[axis : axis + 1]
    same(rotations.of_matrices(Rotation.from_rotvec(vector).as_matrix().reshape(-1, 9)), Rotation.from_rotvec(vector))


def test_tiny_rotations_keep_their_digits():
    vector = np.array([[1e-9, -2e-9, 3e-10]])
    np.testing.assert_allclose(rotations.of_vectors(vector), vector, rtol=1e-14)
    np.testing.assert_allclose(rotations.of_abc(vector), vector[:, ::-1], rtol=1e-8)


def test_no_rotations_are_distinguished_from_rotations():
    good = Rotation.random(3, random_state=1)
    matrix, quaternion = good.as_matrix().reshape(-1, 9), good.as_quat()
    assert not rotations.bad_matrix(matrix).any()
    assert not rotations.bad_quaternion(quaternion).any()
    mirrored = matrix * np.repeat([1.0, 1.0, -1.0], 3)
    assert rotations.bad_matrix(mirrored).all()
    assert rotations.bad_matrix(1.01 * matrix).all()
    assert rotations.bad_quaternion(1.01 * quaternion).all()
