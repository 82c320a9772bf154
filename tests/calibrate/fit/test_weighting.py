"""Weights: rows that share a pose are made independent, and what is cut apart is not."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from acquisition.recording.rig import Arm, ArmModel, Joint, Rig, Tolerance
from calibrate.fit import weighting as weighting_module
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.weighting import Weighting
from calibrate.model.arms.catalogue import arm_of
from calibrate.model.parameters import hold
from calibrate.model.placement import Target
from calibrate.model.problem import Measured, Problem, decorrelated
from calibrate.model.sensors.distance import consecutive_pairs, shared_correlation
from calibrate.model.sensors.tip_distance import PairChain, TipDistance

SIGMA_M, JOINT_RAD = 50e-6, 4e-5


def distances(n, seed=0):
    """Weighting of consecutive distances of an arm, with the exact tips."""
    table = ((0.16, 0.0, np.pi / 2), (0.0, -0.4, 0.0), (0.1, -0.4, np.pi / 2))
    joints = tuple(Joint(-3.0, 3.0, a_m=a, alpha_rad=alpha, d_m=d, theta_offset_rad=0.0) for d, a, alpha in table)
    arm = arm_of(Rig(1, "three", Arm(ArmModel.DH, joints), tolerance=Tolerance(3e-4, 5e-4)))
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, (n, 3))
    chain = PairChain(arm, TipDistance(Target(np.array([0.1, 0.0, 0.05]))))
    T = arm.flange(np.zeros(len(arm.parameters)), q)
    tip = T[:, :3, :3] @ np.array([0.1, 0.0, 0.05]) + T[:, :3, 3]
    pairs, length = consecutive_pairs(np.arange(n), tip)
    problem = Problem(chain, chain.parameters, q[pairs].reshape(len(pairs), -1), length, np.ones((len(pairs), 1, 1)))
    own = {"position": np.full(length.shape, np.sqrt(2.0) * SIGMA_M)}
    measured = Measured("distance", problem, own, pairs, shared_correlation(tip, pairs))
    return Weighting((measured,), JOINT_RAD), q, tip, pairs


def test_decorrelated_rows_have_unit_covariance():
    correlation = np.array([0.4, -0.3, 0.5, 0.0])
    R = np.eye(4) + np.diag(correlation[:3], 1) + np.diag(correlation[:3], -1)
    W = decorrelated(np.eye(4), correlation)
    assert_allclose(W @ R @ W.T, np.eye(4), atol=1e-14)


def test_noise_of_readings_and_positions_leaves_independent_residuals_of_one():
    weighting, q, tip, pairs = distances(30)
    theta, rng = np.zeros(len(weighting.parameters)), np.random.default_rng(1)
    (block,) = weighting.problem(theta).blocks
    by_joint = block.chain.by_joint(theta, block.q_rad)[:, 0]
    drawn = []
    for _ in range(4000):
        seen = tip + rng.normal(0, SIGMA_M, tip.shape)
        off = rng.normal(0, JOINT_RAD, q.shape)
        length = np.linalg.norm(seen[pairs[:, 1]] - seen[pairs[:, 0]], axis=1) - block.observed[:, 0]
        rows = np.einsum("ni,ni->n", by_joint, off[pairs].reshape(len(pairs), -1)) - length
        drawn.append(decorrelated(rows * block.whitener[:, 0, 0], block.correlation))
    covariance = np.cov(np.transpose(drawn))
    assert_allclose(covariance, np.eye(len(pairs)), atol=6.0 / np.sqrt(4000))
    assert np.abs(block.correlation).max() > 0.2  # there was something to take out


def test_rows_cut_apart_are_no_neighbours_any_more():
    weighting, *_ = distances(12)
    theta = np.zeros(len(weighting.parameters))
    whole = weighting.problem(theta).blocks[0]
    rows = np.array([0, 1, 4, 5, 9])
    kept = whole.correlation[rows] * np.array([1, 0, 1, 0, 0])
    assert_allclose(whole.select(rows).correlation, kept)
    assert_allclose(weighting.take(np.array([0, 1, 2, 4, 5, 6])).problem(theta).blocks[0].correlation[[1, 3]], 0.0)


def test_a_long_session_finds_its_noise_from_part_of_its_rows(monkeypatch):
    weighting, *_ = distances(400)
    (measured,) = weighting.measured
    noise = np.random.default_rng(2).normal(0, np.sqrt(2.0) * SIGMA_M, measured.problem.observed.shape)
    noisy = replace(measured, problem=replace(measured.problem, observed=measured.problem.observed + noise))
    weighting, theta = Weighting((noisy,), JOINT_RAD), np.zeros(len(weighting.parameters))
    seen = analyse(weighting.problem(theta).jacobian(theta), weighting.parameters)
    parameters = hold(weighting.parameters, [c.representative for c in seen.combinations])
    every = weighting.noise(parameters, theta)
    monkeypatch.setattr(weighting_module, "ENOUGH", 100)
    some = weighting.noise(parameters, theta)
    assert np.abs(every.factor[1] - 1.0) < 4.0 * every.factor_sigma[1]
    assert np.abs(some.factor[1] - 1.0) < 4.0 * some.factor_sigma[1]
    assert some.factor_sigma[1] > 1.4 * every.factor_sigma[1]
