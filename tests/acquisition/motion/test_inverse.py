"""Inverse kinematics on the arms as drawn and as calibrated: found, exact, all branches."""

import numpy as np
import pytest

from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import all_solutions, within
from acquisition.motion.kinematics import flange, jacobian
from benchmarks.many_poses import solve_many
from tests.acquisition.motion.conftest import irb120, ur5e

POSES = 10_000
CALIBRATED = 1e-3  # m and rad, one sigma: more than any assembly leaves


def random_poses(arm, rng, poses=POSES):
    return arm.frames(rng.uniform(arm.lower_rad, arm.upper_rad, (poses, 6)))[:, -1]


@pytest.mark.parametrize("error", [0.0, CALIBRATED])
def test_999_of_1000_reachable_poses_are_solved_to_a_nanometre(maker, error: float) -> None:
    arm, rng = maker(error), np.random.default_rng(11)
    T = random_poses(arm, rng)
    solved = solve_many(arm, T, np.zeros(6), closed_form(maker()), rng)
    assert solved.found.mean() >= 0.999
    q_rad = solved.q_rad[solved.found]
    assert within(arm, q_rad).all()
    assert np.abs(arm.frames(q_rad)[:, -1] - T[solved.found]).max() < 1e-9


def test_the_posture_itself_is_among_all_solutions(maker) -> None:
    arm, rng, starts = maker(CALIBRATED), np.random.default_rng(5), closed_form(maker())
    for _ in range(20):
        q_rad = rng.uniform(arm.lower_rad, arm.upper_rad)
        T = flange(arm, q_rad)
        found = all_solutions(arm, T, q_rad, starts, rng)
        assert np.abs(found[0] - q_rad).max() < 1e-6
        np.testing.assert_allclose(arm.frames(found)[:, -1], np.broadcast_to(T, (len(found), 4, 4)), atol=1e-9)


def test_a_pose_in_the_middle_of_the_range_of_a_ur_has_eight_branches_and_their_turns() -> None:
    arm, rng = ur5e(), np.random.default_rng(2)
    q_rad = np.array([0.3, -1.4, 1.6, -0.5, 0.5, 0.1])
    assert len(all_solutions(arm, flange(arm, q_rad), q_rad, closed_form(arm), rng)) == 8


def test_random_starts_serve_an_arm_without_closed_form() -> None:
    arm, rng = ur5e(CALIBRATED), np.random.default_rng(7)
    T = random_poses(arm, rng, 200)
    solved = solve_many(arm, T, np.zeros(6), None, rng)
    assert solved.found.mean() >= 0.99
    assert closed_form(arm) is None


def test_out_of_reach_is_not_found() -> None:
    arm, rng = irb120(), np.random.default_rng(1)
    T = np.eye(4)
    T[:3, 3] = (2.0, 0.0, 0.5)
    assert not solve_many(arm, T[None], np.zeros(6), closed_form(arm), rng).found.any()
    assert all_solutions(arm, T, np.zeros(6), closed_form(arm), rng).shape == (0, 6)


def test_jacobian_is_the_slope_of_the_flange(maker) -> None:
    arm, q_rad, step = maker(CALIBRATED), np.array([0.1, -0.4, 0.3, 0.2, 0.7, -0.2]), 1e-6
    J = jacobian(arm.frames(q_rad[None]))[0]
    T = flange(arm, q_rad)
    for joint in range(6):
        ahead, back = (flange(arm, q_rad + sign * step * np.eye(6)[joint]) for sign in (1.0, -1.0))
        slope = (ahead - back) / (2.0 * step)
        spin = slope[:3, :3] @ T[:3, :3].T
        np.testing.assert_allclose(J[:3, joint], slope[:3, 3], atol=1e-8)
        np.testing.assert_allclose(J[3:, joint], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-8)
