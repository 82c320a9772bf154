"""Fused normal equations of tracked positions against the rows that numpy makes."""

import numpy as np
import pytest

from calibrate.kernels import compiled, position_rows
from calibrate.kernels.position_rows import PositionRows
from calibrate.parameters import hold
from calibrate.problem import whitener_of
from calibrate.rigid import pose_offset, pose_offset_twists, transform


def correlated(problem, seed=3):
    """The same problem with another full covariance at every pose."""
    factor = np.random.default_rng(seed).normal(0, 2e-5, (problem.rows, 3, 3))
    return problem.with_covariance(factor @ np.swapaxes(factor, 1, 2) + 1e-10 * np.eye(3))


@pytest.mark.parametrize("poses", [1, 128, 129, 300])
def test_normal_equations_are_those_of_the_rows(tracked, poses):
    case = tracked(poses)
    problem = correlated(case.problem)
    rows, theta = PositionRows.of(problem), 0.7 * case.truth
    J, r = problem.jacobian(theta)[:, rows.scaled.free] * rows.scaled.scale, problem.residual(theta)
    normal = rows.normal(theta)
    np.testing.assert_allclose(normal.matrix, J.T @ J, rtol=1e-12, atol=1e-12 * np.max(np.sum(J**2, axis=0)))
    np.testing.assert_allclose(normal.gradient, J.T @ r, rtol=1e-10, atol=1e-12 * np.linalg.norm(J) * np.linalg.norm(r))
    assert normal.chi2 == pytest.approx(r @ r, rel=1e-9)  # metres at micrometres of noise


def test_rows_are_those_of_the_problem_axis_by_axis(tracked):
    case = tracked(100)
    problem = correlated(case.problem)
    rows = PositionRows.of(problem)
    J = problem.jacobian(case.truth)[:, rows.scaled.free]
    expected = np.column_stack([J, problem.residual(case.truth)]).reshape(100, 3, -1).transpose(1, 0, 2)
    found = rows.rows(case.truth, slice(None)).reshape(3, 100, -1)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(J).max())


def test_held_parameters_of_tool_and_device_leave_the_rows(tracked):
    case = tracked(50)
    problem = case.problem.with_parameters(hold(case.problem.parameters, ["tool.y", "device.roll", "link3.length"]))
    rows = PositionRows.of(problem)
    J = problem.jacobian(case.truth)[:, rows.scaled.free] * rows.scaled.scale
    assert J.shape[1] == 27
    np.testing.assert_allclose(rows.normal(case.truth).matrix, J.T @ J, rtol=1e-12, atol=1e-6)


def test_a_triangle_by_chunks_keeps_the_singular_values(tracked, monkeypatch):
    monkeypatch.setattr(position_rows, "CHUNK_POSES", 64)
    case = tracked(301)
    rows = PositionRows.of(case.problem)
    triangle = rows.triangle(case.truth)
    J = np.column_stack([case.problem.jacobian(case.truth), case.problem.residual(case.truth)])
    assert triangle.shape == (31, J.shape[1])
    J[:, np.setdiff1d(np.arange(len(case.truth)), rows.scaled.free)] = 0.0
    np.testing.assert_allclose(triangle.T @ triangle, J.T @ J, rtol=1e-11, atol=1e-11 * np.sum(J**2))


def test_normal_equations_from_the_triangle_are_the_same(tracked):
    case = tracked(200)
    rows = PositionRows.of(case.problem)
    held = PositionRows.of(case.problem.with_parameters(hold(case.problem.parameters, ["link2.offset", "tool.z"])))
    straight, from_triangle = held.normal(case.truth), held.normal_of(case.truth, rows.triangle(case.truth))
    np.testing.assert_allclose(from_triangle.matrix, straight.matrix, rtol=1e-10, atol=1e-5)
    np.testing.assert_allclose(from_triangle.gradient, straight.gradient, rtol=1e-8, atol=1e-3)
    assert from_triangle.chi2 == pytest.approx(straight.chi2, rel=1e-9)


def test_a_full_weight_is_not_taken_for_a_diagonal_one(tracked):
    case = tracked(20)
    leaning = case.problem.with_covariance(np.tile([[4e-10, 1e-10, 0], [1e-10, 4e-10, 0], [0, 0, 1e-10]], (20, 1, 1)))
    np.testing.assert_array_equal(
        leaning.whitener[0], whitener_of(np.array([[4e-10, 1e-10, 0], [1e-10, 4e-10, 0], [0, 0, 1e-10]]))
    )
    found = PositionRows.of(leaning).normal(case.truth).chi2
    assert found == pytest.approx(np.sum(leaning.residual(case.truth) ** 2), rel=1e-9)
    assert found != pytest.approx(PositionRows.of(case.problem).normal(case.truth).chi2, rel=0.01)


@pytest.mark.parametrize("angle_rad", [0.0, 1e-9, 0.99e-4, 1.01e-4, 0.3, 3.0])
def test_a_moved_device_is_that_of_the_rigid_motions(angle_rad):
    T = transform([1.0, -2.0, 0.5], [0.3, -1.1, 0.7])
    deviation = np.array([0.01, -0.02, 0.03, *(angle_rad * np.array([2.0, -1.0, 2.0]) / 3.0)])
    moved, twists = np.full((4, 4), np.nan), np.full((6, 6), np.nan)
    compiled.moved_frame(T, deviation, moved, twists)
    np.testing.assert_allclose(moved, T @ pose_offset(deviation), atol=1e-15)
    np.testing.assert_allclose(twists.T, pose_offset_twists(T, deviation), atol=2e-12)
