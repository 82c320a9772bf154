"""Held-out error: near the noise where the model is right, above it where something left out has changed."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from benchmarks.drawn_sessions import POSITION_SIGMA_M, SPOT_SIGMA_M
from calibrate.fit.held_out.held_out import Proof, beyond_sigma, held_out
from calibrate.fit.held_out.splits import at_random, by_place, last_block
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.rank.observability import reduced
from calibrate.fit.solvers import solve
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.problem import Problem


def misfit(problem, theta):
    return problem.misfit(theta)


def test_unseen_poses_are_predicted_to_a_little_above_the_noise(fitted):
    one = fitted(2, poses=80)
    found = held_out(one.problem, at_random(80, np.random.default_rng(0)), one.fit.theta, misfit)
    assert found.proof is Proof.DONE
    assert found.rows == 16
    assert 0.8 < found.chi < 1.8
    assert found.rms == pytest.approx(found.chi * POSITION_SIGMA_M, rel=1e-6)


def test_held_out_error_is_above_what_the_fit_says_of_itself(fitted):
    ratios = []
    for seed in range(6):
        one = fitted(20 + seed, poses=30)
        folds = by_place(np.arange(30) % 5)
        inside = np.sqrt(np.mean(one.problem.residual(one.fit.theta) ** 2))
        ratios.append(held_out(one.problem, folds, one.fit.theta).chi / inside)
    assert np.mean(ratios) > 1.2


def test_over_its_own_uncertainty_the_error_is_one_wherever_the_rows_lie(fitted):
    """Places left out in turn, of few poses each: missed by more than the noise, and by what was to be expected."""
    over_noise, over_all = [], []
    for seed in range(6):
        one = fitted(20 + seed, poses=30)
        found = held_out(one.problem, by_place(np.arange(30) % 5), one.fit.theta)
        over_noise.append(found.chi)
        over_all.append(found.chi_predicted)
    assert np.sqrt(np.mean(np.square(over_all))) == pytest.approx(1.0, abs=0.12)  # 6 x 90 values: 0.03 one sigma
    assert np.mean(over_noise) > np.mean(over_all) + 0.1


def test_a_drift_at_the_end_shows_in_the_last_block_only(fitted):
    one = fitted(3, poses=80)
    t_s = np.random.default_rng(1).permutation(80).astype(float)
    moved = one.problem.observed + np.where(t_s >= 64.0, 2e-4, 0.0)[:, None]
    drifted = replace(one.problem, observed=moved)
    still = held_out(one.problem, last_block(t_s), one.fit.theta)
    found = held_out(drifted, last_block(t_s), solve(drifted).theta)
    assert still.chi < 2.0 < 5.0 < found.chi
    assert still.chi_predicted < 1.5 < 4.0 < found.chi_predicted


def test_a_joint_problem_is_cut_the_same_way(fitted):
    one = fitted(2, poses=80)
    joint = JointProblem((one.problem,)).with_parameters(one.problem.parameters)
    split = at_random(80, np.random.default_rng(0))
    alone = held_out(one.problem, split, one.fit.theta)
    assert held_out(joint, split, one.fit.theta).chi == pytest.approx(alone.chi, rel=1e-9)


def test_no_rows_to_fit_is_no_proof(fitted):
    one = fitted(2, poses=80)
    found = held_out(one.problem, by_place(np.zeros(80, dtype=int)), one.fit.theta)
    assert (found.proof, found.chi, found.rms) == (Proof.TOO_FEW, None, None)


@pytest.fixture(scope="module")
def dual_psd(request, bench):
    rig_file = request.config.rootpath / "rigs" / "ur5e-dual-psd.toml"
    session = bench.dual_psd(np.random.default_rng(5), 60)
    chain = dual_psd_chain(load_rig(rig_file), session.placement, session.first_psd)
    weights = np.tile(np.eye(4) / SPOT_SIGMA_M, (60, 1, 1))
    everything = Problem(chain, chain.parameters, session.q_rad, session.observed, weights)
    seen = analyse(everything.jacobian(solve(everything).theta), chain.parameters)
    return everything.with_parameters(reduced(chain.parameters, seen)), session.placement


def test_a_place_left_out_stands_where_its_own_rows_say_and_proves_the_arm(dual_psd):
    problem, placement = dual_psd
    theta = solve(problem).theta
    found = held_out(problem, by_place(placement), theta, misfit)
    assert found.proof is Proof.DONE
    assert found.rows == 60
    assert {name.partition(".")[0] for name in found.refitted} == {"placement1", "placement2"}
    assert 0.8 < found.chi < 4.0
    bent = problem.with_parameters(tuple(replace(p, free=p.free and p.unit == "m") for p in problem.parameters))
    assert held_out(bent, by_place(placement), solve(bent).theta).chi > 10.0 * found.chi


def test_what_unseen_rows_show_beyond_sigma_is_no_chance():
    expected_m = 1e-5
    assert beyond_sigma([(100, 1.1e-5, expected_m)]) == 0.0  # two in a hundred such means are as large
    assert beyond_sigma([(100, 1.5e-5, expected_m)]) == pytest.approx(np.sqrt(1.5**2 - 1.0) * 1e-5)
    half = beyond_sigma([(100, 1.5e-5, expected_m), (100, 0.9e-5, expected_m)])
    assert half == pytest.approx(np.sqrt((1.5**2 - 1.0) / 2.0) * 1e-5)
    assert beyond_sigma([]) == 0.0
