"""All solvers on all problems: known minima, arms, bounds, lost rank; and scipy as an independent witness."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from acquisition.recording.rig import load_rig
from calibrate.fit.rank.identifiability import analyse
from calibrate.fit.rank.observability import reduced
from calibrate.fit.solvers import (
    DogLegRules,
    Method,
    Status,
    Stop,
    solve,
)
from calibrate.model.chain import SensorChain
from calibrate.model.dual_psd_rig import dual_psd_chain
from calibrate.model.parameters import plausible_sizes, start_values
from calibrate.model.placement import Device, Target
from calibrate.model.problem import Problem
from calibrate.model.rigid import transform
from calibrate.model.sensors.position import Position
from tests.calibrate.fit.known_minima import Known, bent_valley, powell_singular, rosenbrock, unknowns

POSITION_SIGMA_M = 20e-6
TIGHT = DogLegRules(e2=1e-12, kmax=500)  # beyond what any measurement needs, to compare with scipy


def beale():
    """More, Garbow, Hillstrom, ACM Trans. Math. Software 7(1), 1981, problem 5: minimum 0 at (3, 0.5)."""
    y = np.array([1.5, 2.25, 2.625])
    k = np.arange(1, 4)
    return Known(
        unknowns(1.0, 1.0),
        lambda t: y - t[0] * (1.0 - t[1] ** k),
        lambda t: np.column_stack([t[1] ** k - 1.0, t[0] * k * t[1] ** (k - 1)]),
    )


def bard():
    """The same, problem 8: minimum 8.21487e-3 (twice the halved one), residuals that stay."""
    y = np.array([0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39])
    u = np.arange(1, 16.0)
    v, w = 16.0 - u, np.minimum(u, 16.0 - u)
    return Known(
        unknowns(1.0, 1.0, 1.0),
        lambda t: y - (t[0] + u / (v * t[1] + w * t[2])),
        lambda t: np.column_stack(
            [-np.ones(15), u * v / (v * t[1] + w * t[2]) ** 2, u * w / (v * t[1] + w * t[2]) ** 2]
        ),
    )


def box():
    """The same, problem 12 with 10 rows: minimum 0 at (1, 10, 1)."""
    x = 0.1 * np.arange(1, 11)
    return Known(
        unknowns(0.0, 10.0, 20.0),
        lambda t: np.exp(-t[0] * x) - np.exp(-t[1] * x) - t[2] * (np.exp(-x) - np.exp(-10.0 * x)),
        lambda t: np.column_stack(
            [-x * np.exp(-t[0] * x), x * np.exp(-t[1] * x), np.exp(-10.0 * x) - np.exp(-x)],
        ),
    )


def bent_sum():
    """Only the sum of two unknowns is seen, and that through a curve."""
    return Known(
        unknowns(0.2, 0.0),
        lambda t: [np.exp(t[0] + t[1]) - 2.0, t[0] + t[1] - 0.5],
        lambda t: [[np.exp(t[0] + t[1])] * 2, [1.0, 1.0]],
    )


def free_truth(draw, seed):
    truth = draw(np.random.default_rng(seed))
    return truth, np.random.default_rng(seed + 1000)


@pytest.fixture(scope="module")
def tracker(request, ur5e_truth):
    """60 positions of a target, device frame off by some millimetres from where it was believed."""
    truth, rng = free_truth(ur5e_truth, 5)
    rig = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")
    q_rad = rng.uniform(-2.5, 2.5, (60, 6))
    point_m = np.array([0.02, 0.01, 0.08])
    with_prior = transform([1.5, 0.4, 0.3], [0.1, -0.2, 2.0])
    R = Rotation.from_rotvec([0.1, -0.2, 2.0]) * Rotation.from_rotvec(rng.normal(0, 2e-3, 3))
    origin_m = np.array([1.5, 0.4, 0.3]) + rng.normal(0, 3e-3, 3)
    base = np.array([(truth.flange(q) @ [*point_m, 1.0])[:3] for q in q_rad + truth.zeros])
    seen = R.inv().apply(base - origin_m) + rng.normal(0, POSITION_SIGMA_M, base.shape)
    arm = dual_psd_chain(rig, np.ones(1, dtype=int), np.ones(1, dtype=int)).model
    chain = SensorChain(arm, Position(Target(point_m + 1e-3), Device(with_prior)))
    return determined(Problem(chain, chain.parameters, q_rad, seen, np.tile(np.eye(3) / POSITION_SIGMA_M, (60, 1, 1))))


@pytest.fixture(scope="module")
def dual_psd(request, sessions):
    rig = load_rig(request.config.rootpath / "rigs" / "ur5e-dual-psd.toml")
    session = sessions(31, n=60)
    chain = dual_psd_chain(rig, session.placement, session.first_psd)
    W = np.tile(np.eye(4) / 5e-6, (60, 1, 1))
    return determined(Problem(chain, chain.parameters, session.q_rad, session.spots_m, W))


def determined(problem):
    """The problem with what its data do not see removed, at its start and again at its answer."""
    while True:
        fit = solve(problem)
        seen = analyse(problem.jacobian(fit.theta), problem.parameters)
        if not seen.combinations:
            return problem
        problem = problem.with_parameters(reduced(problem.parameters, seen))


PLAIN = {"rosenbrock": rosenbrock, "beale": beale, "bard": bard, "box": box}
FULL_RANK = (*PLAIN, "tracker", "dual_psd")


def named(name, request):
    return PLAIN[name]() if name in PLAIN else request.getfixturevalue(name)


def scipy_answer(problem, name):
    """The free parameters by scipy, priors as rows: (cost, theta)."""
    free = np.flatnonzero([p.free for p in problem.parameters])
    scale = plausible_sizes(problem.parameters)[free]
    prior = np.array([problem.parameters[i].prior for i in free])
    start = start_values(problem.parameters)
    with_prior = np.flatnonzero(np.isfinite(prior))

    def full(x):
        theta = start.copy()
        theta[free] = x
        return theta

    def rows(x):
        return np.concatenate([problem.residual(full(x)), ((x - start[free]) / prior)[with_prior]])

    def slope(x):
        return np.concatenate([problem.jacobian(full(x))[:, free], np.diag(1.0 / prior)[with_prior]])

    tight = {"xtol": 1e-15, "ftol": None, "gtol": 1e-15, "max_nfev": 300}
    found = least_squares(rows, start[free], jac=slope, method=name, x_scale=scale, **tight)
    return 2.0 * found.cost, full(found.x)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("name", FULL_RANK)
def test_every_solver_agrees_with_scipy_on_every_full_rank_problem(method, name, request):
    problem = named(name, request)
    fit = solve(problem, method=method, tolerance=1e-20, max_steps=500, rules=TIGHT)
    assert fit.status is Status.CONVERGED
    # Solvers compare costs. The rounding of a metre (2e-16 m) before noise of a micrometre leaves 2e-10 of a whitened
    # row open, hence 2 sqrt(chi2) 2e-10 = 4e-9 of a cost of 80 and its root, 6e-5 sigma, of the solution: where within
    # that two solvers stop depends on the processor. Without noise sigma is 0, and the digits of theta count.
    sigma = np.sqrt(np.diag(fit.covariance) * min(fit.chi2_per_dof if fit.dof else 0.0, 1.0))
    close = 1e-9 * np.maximum(np.abs(fit.theta), plausible_sizes(problem.parameters)) + 1e-4 * sigma
    for peer in ("trf", "dogbox"):
        cost, theta = scipy_answer(problem, peer)
        assert fit.chi2 == pytest.approx(cost, rel=1e-9, abs=1e-9), peer
        np.testing.assert_array_less(np.abs(fit.theta - theta), close, err_msg=peer)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize(
    ("name", "minimum", "at"),
    [
        ("rosenbrock", 0.0, [1.0, 1.0]),
        ("beale", 0.0, [3.0, 0.5]),
        ("bard", 8.21487e-3, [0.0824106, 1.133036, 2.343695]),
        ("box", 0.0, [1.0, 10.0, 1.0]),
    ],
)
def test_published_minima_are_found(method, name, minimum, at):
    fit = solve(PLAIN[name](), method=method, tolerance=1e-18, max_steps=500, rules=TIGHT)
    assert fit.chi2 == pytest.approx(minimum, rel=1e-5, abs=1e-15)
    np.testing.assert_allclose(fit.theta, at, rtol=2e-6)


@pytest.mark.parametrize("method", list(Method))
def test_a_minimum_where_the_jacobian_vanishes_is_approached(method):
    assert solve(powell_singular(), method=method).chi2 < 1e-8


@pytest.mark.parametrize("method", list(Method))
def test_lost_rank_is_said_and_has_no_covariance(method):
    fit = solve(bent_sum(), method=method, tolerance=1e-16)
    assert fit.status is Status.RANK_DEFICIENT
    assert np.isnan(fit.covariance).all()
    best = least_squares(lambda s: [np.exp(s[0]) - 2.0, s[0] - 0.5], [0.2], xtol=1e-15, gtol=1e-15)
    assert fit.theta.sum() == pytest.approx(best.x[0], abs=1e-6)
    assert fit.theta[0] - fit.theta[1] == pytest.approx(0.2)  # what is not seen stays where it started


@pytest.mark.parametrize("method", list(Method))
def test_an_arm_with_its_unseen_combinations_left_in_says_so(method, dual_psd):
    everything = dual_psd.with_parameters(dual_psd.chain.parameters)
    fit = solve(everything, method=method)
    assert fit.status is Status.RANK_DEFICIENT
    assert fit.chi2 == pytest.approx(solve(dual_psd, method=method).chi2, rel=1e-6)


@pytest.mark.parametrize("method", list(Method))
@pytest.mark.parametrize("peer", ["trf", "dogbox"])
def test_bounds_hold_and_the_others_go_to_their_best_as_scipy_says(method, peer):
    problem = rosenbrock(lower=-2.0, upper=0.5)
    fit = solve(problem, method=method, start=np.array([-1.2, 0.4]), tolerance=1e-18, max_steps=500, rules=TIGHT)
    witness = least_squares(
        problem.residual,
        [-1.2, 0.4],
        jac=problem.jacobian,
        bounds=([-2.0, -2.0], [0.5, 0.5]),
        method=peer,
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    assert fit.status is Status.AT_BOUND
    assert fit.at_bound == ("p0",)
    np.testing.assert_allclose(fit.theta, witness.x, atol=1e-6)
    assert fit.chi2 <= 2.0 * witness.cost * (1.0 + 1e-9)


@pytest.mark.parametrize("method", list(Method))
def test_a_zero_bounded_short_of_its_truth_ends_at_the_bound(method, tracker):
    short = tuple(replace(p, upper=1e-4, lower=-1e-4) if p.name == "joint3.zero" else p for p in tracker.parameters)
    fit = solve(tracker.with_parameters(short), method=method, max_steps=300)
    assert fit.status is Status.AT_BOUND
    assert fit.at_bound == ("joint3.zero",)


@pytest.mark.parametrize("method", list(Method))
def test_too_few_steps_and_residuals_that_are_not_finite_are_said(method):
    assert solve(rosenbrock(), method=method, max_steps=2).status is Status.OUT_OF_STEPS
    broken = Known(unknowns(0.0), lambda t: [np.inf], lambda t: np.ones((1, 1)))
    assert solve(broken, method=method).status is Status.NOT_FINITE


@pytest.mark.parametrize("method", list(Method))
def test_a_derivative_of_the_wrong_sign_stalls_and_does_not_claim_convergence(method):
    wrong = Known(unknowns(1.0), lambda t: [t[0] - 5.0, t[0] - 5.5], lambda t: -np.ones((2, 1)))
    fit = solve(wrong, method=method, max_steps=500)
    assert fit.status is Status.STALLED


def test_steps_follow_a_bent_valley():
    """Straight ones leave it at once, and damped ones need 39."""
    found = solve(bent_valley(), damping=1e-9, tolerance=1e-3)
    assert found.stop is Stop.GAIN
    assert found.chi2 < 1e-3
    assert found.steps <= 10
