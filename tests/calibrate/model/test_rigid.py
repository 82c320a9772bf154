"""Rigid motions obey the laws of the group, mirrors included."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from calibrate.model.rigid import (
    adjoint,
    cross_matrix,
    inverse,
    left_jacobian,
    pose_offset,
    pose_offset_twists,
    transform,
)

VECTOR = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])


def matrix_of(twist):
    out = np.zeros((4, 4))
    out[:3, :3], out[:3, 3] = cross_matrix(twist[3:]), twist[:3]
    return out


@given(VECTOR, VECTOR)
def test_inverse_undoes_a_pose_and_a_mirrored_pose(origin, rotation):
    for T in (transform(origin, rotation), transform(origin, rotation) @ MIRROR):
        np.testing.assert_allclose(inverse(T) @ T, np.eye(4), atol=1e-14)


@given(VECTOR, VECTOR, VECTOR, VECTOR)
def test_adjoint_moves_a_twist_as_conjugation_moves_its_matrix(origin, rotation, v, w):
    twist = np.concatenate([v, w])
    for T in (transform(origin, rotation), transform(origin, rotation) @ MIRROR):
        np.testing.assert_allclose(matrix_of(adjoint(T) @ twist), T @ matrix_of(twist) @ np.linalg.inv(T), atol=1e-12)


@given(VECTOR)
def test_left_jacobian_is_the_integral_of_the_rotation(rotation):
    s, weights = np.polynomial.legendre.leggauss(20)  # J = int_0^1 Exp(s r) ds
    integral = sum(k / 2 * expm((x + 1) / 2 * cross_matrix(rotation)) for x, k in zip(s, weights, strict=True))
    np.testing.assert_allclose(left_jacobian(rotation), integral, atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-7, 1e-4, 0.3])
def test_pose_offset_twists_are_differences(size):
    rng = np.random.default_rng(6)
    nominal, deviation = transform(rng.normal(size=3), rng.normal(size=3)), size * rng.normal(size=6)
    analytic = pose_offset_twists(nominal, deviation)
    for k, step in enumerate(np.eye(6) * 1e-6):
        move = nominal @ pose_offset(deviation + step) @ np.linalg.inv(nominal @ pose_offset(deviation - step))
        w = Rotation.from_matrix(move[:3, :3]).as_rotvec()
        v = move[:3, 3] - np.cross(w, move[:3, 3]) / 2.0  # logarithm to second order in a tiny step
        np.testing.assert_allclose(analytic[:, k], np.concatenate([v, w]) / 2e-6, atol=1e-9)
