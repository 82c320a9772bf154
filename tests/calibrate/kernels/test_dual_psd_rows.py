"""Compiled rows of the dual PSD against those that numpy makes, for every kind of arm."""

from dataclasses import replace

import numpy as np
import pytest

from acquisition.recording.rig import load_rig
from acquisition.recording.rig_schema import Arm, ArmModel, Joint, Pose, Rig
from calibrate.arms.catalogue import ARMS, arm_of
from calibrate.chain import Chain
from calibrate.dual_psd_rig import dual_psd_chain
from calibrate.fit import NEAR_START, solve
from calibrate.kernels.dual_psd_rows import DualPsdRows
from calibrate.kernels.normal_fit import fit_normal
from calibrate.parameters import hold
from calibrate.problem import Problem
from calibrate.sensors.dual_psd import PairBelief
from calibrate.solvers.levenberg import LevenbergRules

PAIR = PairBelief(5e-5, 1e-3)


@pytest.fixture(scope="module")
def rig(request):
    return load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")


def drawn_joints(model, rng, n):
    if model is ArmModel.LOCAL_POE:
        vectors = rng.normal(0, 0.3, (n, 2, 3)).tolist()
        return tuple(Joint(lower_rad=-3.0, upper_rad=3.0, origin_m=tuple(o), rotation_rad=tuple(r)) for o, r in vectors)
    rows = rng.normal(0, 0.5, (n, 4)).tolist()
    return tuple(
        Joint(lower_rad=-3.0, upper_rad=3.0, d_m=d, a_m=a, alpha_rad=alpha, theta_offset_rad=offset)
        for d, a, alpha, offset in rows
    )


def drawn_problem(rig, poses, model=None, gain_prior=None, pair_prior=None):
    """Poses anywhere, spots far off any face, a full covariance of its own at every pose: enough for formulas."""
    rng = np.random.default_rng(poses)
    placement, first = rng.choice(list(rig.placements), poses), rng.integers(1, 3, poses)
    chain = dual_psd_chain(rig, placement, first)
    if model is not None:
        other = Rig(
            1, "law", Arm(model, drawn_joints(model, rng, 6), flange=Pose((0.01, -0.02, 0.03), (0.1, 0.2, -0.3)))
        )
        chain = Chain(arm_of(other), chain.sensor)
    chain = replace(chain, sensor=replace(chain.sensor, gain_prior=gain_prior, pair_prior=pair_prior))
    factor = rng.normal(0, 2e-6, (poses, 4, 4))
    covariance = factor @ np.swapaxes(factor, 1, 2) + 1e-12 * np.eye(4)
    q, spots = rng.uniform(-2.5, 2.5, (poses, 6)), rng.normal(0, 1e-3, (poses, 4))
    problem = Problem(chain, chain.parameters, q, spots, np.zeros((poses, 4, 4))).with_covariance(covariance)
    start = np.array([p.start for p in chain.parameters])
    return problem, start + rng.normal(0, 1e-2, len(start))


def rows_by_numpy(problem, theta, free):
    """Poses first, as the compiled rows run."""
    both = np.column_stack([problem.jacobian(theta)[:, free], problem.residual(theta)])
    return both.reshape(problem.rows, 4, -1).transpose(1, 0, 2).reshape(4 * problem.rows, -1)


def agree(found, expected):
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max(axis=0).max())
    scale = np.abs(expected).max(axis=0)
    assert np.all(np.abs(found - expected).max(axis=0) <= 1e-11 * scale)


@pytest.mark.parametrize("poses", [1, 127, 128, 129, 300])
@pytest.mark.parametrize(("gain_prior", "pair_prior"), [(None, None), (5e-3, None), (None, PAIR), (5e-3, PAIR)])
def test_rows_are_those_of_the_problem_whatever_is_free(rig, poses, gain_prior, pair_prior):
    problem, theta = drawn_problem(rig, poses, gain_prior=gain_prior, pair_prior=pair_prior)
    rows = DualPsdRows.of(problem)
    agree(rows.rows(theta), rows_by_numpy(problem, theta, rows.scaled.free))


@pytest.mark.parametrize("model", ARMS, ids=lambda model: model.value)
def test_rows_hold_for_every_kind_of_arm(rig, model):
    problem, theta = drawn_problem(rig, 40, model=model)
    rows = DualPsdRows.of(problem)
    agree(rows.rows(theta), rows_by_numpy(problem, theta, rows.scaled.free))
    np.testing.assert_allclose(rows.by_joint(theta), problem.chain.by_joint(theta, problem.q_rad), rtol=1e-9, atol=1e-9)


def test_held_parameters_leave_the_rows(rig):
    problem, theta = drawn_problem(rig, 30, gain_prior=5e-3)
    names = ["joint2.zero", "link3.length", "laser.tilt_u", "psd1.gain_y", f"placement{min(rig.placements)}.yaw"]
    held = problem.with_parameters(hold(problem.parameters, names))
    rows = DualPsdRows.of(held)
    assert len(rows.scaled.free) == sum(p.free for p in problem.parameters) - len(names)
    agree(rows.rows(theta), rows_by_numpy(held, theta, rows.scaled.free))


def test_normal_equations_are_those_of_rows_and_triangle(rig):
    problem, theta = drawn_problem(rig, 130)
    rows = DualPsdRows.of(problem)
    J, r = rows.rows(theta)[:, :-1] * rows.scaled.scale, rows.rows(theta)[:, -1]
    prior = rows.scaled.information
    pull = prior * (theta[rows.scaled.free] - rows.scaled.centre) / rows.scaled.scale
    for normal in (rows.normal(theta), rows.normal_of(theta, rows.triangle(theta))):
        size = np.max(np.diag(normal.matrix))
        np.testing.assert_allclose(normal.matrix, J.T @ J + np.diag(prior), atol=1e-11 * size)
        np.testing.assert_allclose(normal.gradient, J.T @ r + pull, atol=1e-11 * np.sqrt(size * normal.chi2))


def test_other_weights_are_taken(rig):
    problem, theta = drawn_problem(rig, 20)
    plain = np.tile(np.eye(4), (20, 1, 1))
    found = DualPsdRows.of(problem).weighted(plain).rows(theta)
    agree(found, rows_by_numpy(replace(problem, whitener=plain), theta, DualPsdRows.of(problem).scaled.free))


def test_other_problems_are_declined(rig):
    problem, _ = drawn_problem(rig, 5)
    pair = tuple(replace(p, free=True) if p.name == "psd2.x" else p for p in problem.parameters)
    assert DualPsdRows.of(problem.with_parameters(pair)) is None  # no derivative without a prior
    assert DualPsdRows.of(replace(problem, correlation=np.zeros(5))) is None
    assert DualPsdRows.of(problem) is not None


def test_the_fit_is_that_of_the_solver(rig):
    problem, theta = drawn_problem(rig, 60)
    truth = 0.1 * theta
    problem = problem.with_parameters(hold(problem.parameters, ["joint1.zero", "joint6.zero"]))
    truth[[p.name in ("joint1.zero", "joint6.zero") or not p.free for p in problem.parameters]] = 0.0
    truth[[p.name.startswith("psd") and "gain" in p.name for p in problem.parameters]] = 1.0
    noise = np.linalg.solve(problem.whitener, np.random.default_rng(3).normal(size=(60, 4, 1)))[..., 0]
    problem = replace(problem, observed=problem.chain.expect(truth, problem.q_rad) + noise)
    rows, rules = DualPsdRows.of(problem), LevenbergRules(NEAR_START)
    fast, general = fit_normal(rows, truth, rows.normal(truth), rules), solve(problem, start=truth, damping=NEAR_START)
    sigma = np.sqrt(np.diag(general.covariance))
    free = rows.scaled.free
    assert fast.status is general.status
    assert (fast.dof, fast.stop) == (general.dof, general.stop)
    assert fast.chi2 == pytest.approx(general.chi2, rel=1e-7)
    assert np.all(np.abs(fast.theta - general.theta)[free] <= 1e-6 * sigma[free])
    np.testing.assert_allclose(np.sqrt(np.diag(fast.covariance))[free], sigma[free], rtol=1e-6)
