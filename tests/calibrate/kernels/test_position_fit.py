"""Fast identification from tracked positions: same answer as the solver that holds all rows, same honesty."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.arms.serial import SerialArm
from calibrate.errors import DataError
from calibrate.fit import Status, solve
from calibrate.identifiability import analyse
from calibrate.kernels.position_fit import fit_positions, identify_positions
from calibrate.parameters import hold


def with_priors(problem, sigma_m=3e-4, sigma_rad=5e-4):
    """Links believed as drawn; zeros but the last, tool and device free."""
    parameters = tuple(
        replace(p, prior=sigma_m if p.unit == "m" else sigma_rad) if p.name.startswith("link") else p
        for p in problem.parameters
    )
    return problem.with_parameters(hold(parameters, ["joint6.zero"]))


@pytest.fixture
def reduced(tracked):
    """A problem of full rank, and what was held for it."""
    problem = tracked(300).problem
    seen = analyse(problem.jacobian(np.zeros(len(problem.parameters))), problem.parameters)
    return problem.with_parameters(hold(problem.parameters, (c.representative for c in seen.combinations)))


def test_the_fit_is_that_of_the_general_solver(reduced):
    fast, general = fit_positions(reduced), solve(reduced)
    assert fast.status is general.status is Status.CONVERGED
    sigma = np.sqrt(np.diag(general.covariance))
    assert np.all(np.abs(fast.theta - general.theta) <= 1e-4 * sigma)
    np.testing.assert_allclose(fast.covariance, general.covariance, rtol=1e-6, atol=1e-9 * np.max(general.covariance))
    assert fast.chi2 == pytest.approx(general.chi2, rel=1e-9)
    assert (fast.dof, fast.parameters) == (general.dof, general.parameters)


def test_beliefs_about_the_links_pull_as_in_the_general_solver(tracked):
    problem = with_priors(tracked(30).problem)
    fast, general = fit_positions(problem), solve(problem)
    assert fast.status is general.status is Status.CONVERGED
    assert np.all(np.abs(fast.theta - general.theta) <= 1e-4 * np.sqrt(np.diag(general.covariance)) + 1e-15)
    assert fast.chi2 == pytest.approx(general.chi2, rel=1e-8)
    assert fast.dof == general.dof


def test_what_the_data_cannot_see_is_named_and_never_fitted(tracked):
    case = tracked(300)
    result = identify_positions(case.problem)
    whole = analyse(case.problem.jacobian(np.zeros(len(case.truth))), case.problem.parameters)
    assert result.seen.rank == whole.rank < 30
    assert sorted(m for c in result.seen.combinations for m in c.members) == sorted(
        m for c in whole.combinations for m in c.members
    )
    for combination in result.seen.combinations:
        column = [p.name for p in case.problem.parameters].index(combination.representative)
        assert not result.fit.parameters[column].free
        assert result.fit.theta[column] == 0.0
    assert result.fit.status is Status.CONVERGED
    assert 0.8 < result.fit.chi2_per_dof < 1.2


def test_rank_deficient_data_never_converge_quietly(tracked):
    """Without the analysis before, the normal matrix is singular, and the status says so."""
    assert fit_positions(tracked(300).problem).status is not Status.CONVERGED


def test_identified_arms_predict_new_poses_to_the_noise(tracked):
    case = tracked(300)
    theta = identify_positions(case.problem).fit.theta
    q = np.random.default_rng(9).uniform(-2.5, 2.5, (500, 6))
    chain = case.problem.chain
    error = chain.expect(theta, q) - chain.expect(case.truth, q)
    before = chain.expect(np.zeros(len(theta)), q) - chain.expect(case.truth, q)
    assert np.sqrt(np.mean(error**2)) < 10e-6 < 1e-3 < np.sqrt(np.mean(before**2))


def test_noise_free_data_end_at_the_truth_of_what_is_seen(tracked):
    case = tracked(200, noise_m=0.0)
    fit = identify_positions(case.problem).fit
    assert fit.status is Status.CONVERGED
    assert fit.chi2 < 1e-6
    assert np.abs(case.problem.misfit(fit.theta)).max() < 1e-9


def test_stated_intervals_hold_the_truth(tracked):
    """Of combinations that the data see: pulls of held members are in the free ones, so predictions are compared."""
    pulls = []
    for seed in range(20):
        case = tracked(100, seed=seed)
        fit = identify_positions(case.problem).fit
        q = np.random.default_rng(seed + 100).uniform(-2.5, 2.5, (3, 6))
        J = case.problem.chain.jacobian(fit.theta, q)
        sigma = np.sqrt(np.einsum("nij,jk,nik->ni", J, fit.covariance, J))
        pulls.append((case.problem.chain.expect(fit.theta, q) - case.problem.chain.expect(case.truth, q)) / sigma)
    rms = np.sqrt(np.mean(np.square(pulls)))
    assert 0.8 < rms < 1.25


def test_bounds_are_left_to_the_general_solver(reduced):
    index = [p.name for p in reduced.parameters].index("joint2.zero")
    tight = replace(reduced.parameters[index], lower=-1e-6, upper=1e-6)
    bounded = reduced.with_parameters((*reduced.parameters[:index], tight, *reduced.parameters[index + 1 :]))
    fit = fit_positions(bounded)
    assert fit.status is Status.AT_BOUND
    assert fit.at_bound == ("joint2.zero",)


def test_a_reading_that_is_no_number_ends_as_not_finite(tracked):
    problem = tracked(100).problem
    spoilt = replace(problem, q_rad=np.where(np.arange(100)[:, None] == 7, np.nan, problem.q_rad))
    result = identify_positions(spoilt)
    assert result.seen is None
    assert result.fit.status is Status.NOT_FINITE
    assert np.all(np.isnan(result.fit.covariance))


def test_no_step_allowed_says_so(reduced):
    assert fit_positions(reduced, max_steps=1).status is Status.OUT_OF_STEPS


def test_no_poses_are_refused(tracked):
    with pytest.raises(DataError, match="no poses at all"):
        identify_positions(tracked(1).problem.select(np.empty(0, dtype=np.intp)))


def test_another_instrument_is_refused(tracked):
    problem = tracked(5).problem

    class Elsewhere:
        model = problem.chain.model
        parameters = problem.chain.parameters

    assert isinstance(problem.chain.model, SerialArm)
    with pytest.raises(DataError, match="not a serial arm with a position instrument"):
        fit_positions(replace(problem, chain=Elsewhere()))
