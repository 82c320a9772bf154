"""The front door sends tracked positions through the compiled loops, and nobody can tell by the answer."""

from dataclasses import replace

import numpy as np
import pytest

from calibrate.fit import FAR_START, NEAR_START, Loss, Method, Status, solve
from calibrate.identifiability import analyse
from calibrate.joint_problem import JointProblem
from calibrate.kernels import ready
from calibrate.kernels.position_fit import identify_positions, positions_of, short_jacobian
from calibrate.parameters import hold, plausible_sizes
from calibrate.redundant import Redundant, reduced
from calibrate.solvers import solve as by_rows

POSES = 300


@pytest.fixture(autouse=True)
def loops(monkeypatch, numpy_models):
    """The loops serve whatever the number of poses; compiled in the test where no cache is at hand."""
    monkeypatch.setattr(ready, "worth", lambda poses: poses > 0)


@pytest.fixture
def joint(tracked):
    return JointProblem((tracked(POSES).problem,))


def determined(problem, how=Redundant.REMOVED):
    theta = np.zeros(len(problem.parameters))
    seen = analyse(problem.jacobian(theta), problem.parameters)
    return problem.with_parameters(reduced(problem.parameters, seen, how))


@pytest.mark.parametrize("damping", [FAR_START, NEAR_START])
@pytest.mark.parametrize("how", list(Redundant))
def test_answers_are_those_of_the_solver_that_holds_all_rows(joint, how, damping):
    problem = determined(joint, how)
    assert positions_of(problem) is not None
    fast, general = solve(problem, damping=damping), by_rows.solve(problem, damping=damping)
    assert fast.status is general.status is Status.CONVERGED
    assert (fast.stop, fast.dof, fast.parameters) == (general.stop, general.dof, general.parameters)
    assert np.max(np.abs(fast.theta - general.theta) / plausible_sizes(problem.parameters)) < 1e-9
    assert fast.chi2 == pytest.approx(general.chi2, rel=1e-9)
    scale = np.sqrt(np.diag(general.covariance)) + 1e-30
    np.testing.assert_allclose(
        fast.covariance / np.outer(scale, scale), general.covariance / np.outer(scale, scale), atol=1e-7
    )


def test_rank_and_words_are_those_of_the_rows(joint):
    theta = np.full(len(joint.parameters), 1e-3)
    short = short_jacobian(joint, theta, joint.parameters)
    assert len(short) < 40 < POSES * 3
    fast, general = analyse(short, joint.parameters), analyse(joint.jacobian(theta), joint.parameters)
    assert fast.rank == general.rank < fast.n_free
    assert fast.combinations == general.combinations
    np.testing.assert_allclose(fast.singular_values, general.singular_values, atol=1e-12 * general.singular_values[0])
    np.testing.assert_allclose(fast.sigma, general.sigma, rtol=1e-7)


def test_rank_is_asked_of_parameters_that_the_fit_held(joint):
    """A fit holds a member of an unseen combination; the question what was unseen is about all of them."""
    fitted, theta = determined(joint), np.zeros(len(joint.parameters))
    assert positions_of(fitted) is not None
    seen = analyse(short_jacobian(fitted, theta, joint.parameters), joint.parameters)
    assert seen.rank == analyse(joint.jacobian(theta), joint.parameters).rank
    assert seen.n_free == sum(p.free for p in joint.parameters)


def test_what_is_redundant_is_held_by_priors_on_request(joint):
    problem = positions_of(joint)
    result = identify_positions(problem, redundant=Redundant.HELD_BY_PRIORS)
    general = by_rows.solve(determined(joint, Redundant.HELD_BY_PRIORS), damping=NEAR_START)
    assert result.fit.status is Status.CONVERGED
    assert all(p.free for p, q in zip(result.fit.parameters, problem.parameters, strict=True) if q.free)
    assert np.max(np.abs(result.fit.theta - general.theta) / plausible_sizes(problem.parameters)) < 1e-9


def test_a_problem_of_one_block_keeps_its_own_names_and_choices(joint):
    held = joint.with_parameters(hold(joint.parameters, ["link3.length"]))
    assert positions_of(held).parameters == held.parameters
    assert positions_of(joint).parameters == joint.parameters


def test_everything_else_is_left_to_the_rows(joint, tracked, monkeypatch):
    block = joint.blocks[0]
    assert positions_of(JointProblem((block, tracked(POSES, seed=1).problem))) is None
    assert positions_of(replace(block, correlation=np.zeros(3 * POSES))) is None
    monkeypatch.setattr(ready, "worth", lambda poses: False)
    assert positions_of(joint) is None


def test_other_methods_and_losses_are_those_asked_for(joint):
    problem = determined(joint)
    robust = solve(problem, loss=Loss.CAUCHY)
    assert robust.weights is not None
    dogleg = solve(problem, method=Method.DOGLEG)
    assert dogleg.stop is by_rows.solve(problem, method=Method.DOGLEG).stop


def test_bounds_hold_at_the_front_door_too(joint):
    problem = determined(joint)
    tight = tuple(replace(p, lower=-1e-6, upper=1e-6) if p.name == "joint2.zero" else p for p in problem.parameters)
    fit = solve(problem.with_parameters(tight))
    assert fit.status is Status.AT_BOUND
    assert fit.at_bound == ("joint2.zero",)


@pytest.mark.parametrize("solver", [solve, by_rows.solve])
def test_dependent_columns_have_no_covariance_and_never_converge(joint, solver):
    fit = solver(joint)
    assert fit.status is not Status.CONVERGED
    assert np.all(np.isnan(fit.covariance))
