"""The search for the sizes of noise: to the maximum from any belief, and to an end where a source is not there."""

import numpy as np
import pytest
from scipy.optimize import minimize

from calibrate.fit.noise import variance
from calibrate.fit.noise.restricted_likelihood import NoisyRows, independent, score_at
from calibrate.fit.noise.variance import LOG_VARIANCE_PRIOR, MAX_STEPS
from calibrate.model.problem import parts_of


def drawn(joint_rad, psd_m, assumed=(3e-6, 2e-6), n=200, columns=12, seed=1):
    """Spots of `n` poses after a linear fit, joints and detectors of these sizes."""
    rng = np.random.default_rng(seed)
    by_joint = rng.normal(0, 0.5, (n, 4, 6))
    J = rng.normal(size=(n, 4, columns))
    misfit = np.einsum("nij,nj->ni", by_joint, rng.normal(0, joint_rad, (n, 6))) + rng.normal(0, psd_m, (n, 4))
    parts = parts_of(by_joint, assumed[0], np.full((n, 4), assumed[1]))
    return NoisyRows(misfit + J @ rng.normal(0, 1e-6, columns), J, parts, (0, 1))


def estimate(rows, start=None):
    nothing = np.zeros(rows.jacobian.shape[-1])
    return variance.estimate((rows,), 2, nothing, nothing, start)


def best(rows):
    """By a minimiser that knows the value alone."""

    def cost(log_variance):
        V = np.einsum("c,cnij->nij", np.exp(log_variance), rows.parts)
        weight = np.linalg.inv(V)
        normal = np.einsum("nip,nij,njq->pq", rows.jacobian, weight, rows.jacobian)
        pull = np.einsum("nip,nij,nj->p", rows.jacobian, weight, rows.misfit)
        left = np.einsum("ni,nij,nj->", rows.misfit, weight, rows.misfit) - pull @ np.linalg.solve(normal, pull)
        bulk = np.sum(np.linalg.slogdet(V)[1]) + np.linalg.slogdet(normal)[1] + left
        return 0.5 * bulk + 0.5 * np.sum(log_variance**2) / LOG_VARIANCE_PRIOR**2

    return minimize(cost, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-10}).x


@pytest.mark.parametrize("size", [(3e-6, 2e-6), (2e-5, 4e-7), (4e-7, 1e-5), (3e-6, 0.0), (0.0, 2e-6)])
def test_the_largest_likelihood_is_found(size):
    rows = drawn(*size, n=80)
    found = estimate(rows)
    assert found.converged
    np.testing.assert_allclose(found.log_variance, best(rows), atol=1e-5)


@pytest.mark.parametrize(("size", "at_zero"), [((0.0, 2e-6), (True, False)), ((3e-6, 0.0), (False, True))])
def test_a_source_that_is_not_there_ends_at_zero_in_a_few_steps(size, at_zero, monkeypatch):
    steps = []
    monkeypatch.setattr(variance, "score_at", lambda *args: steps.append(0) or score_at(*args))
    found = estimate(drawn(*size))
    assert (found.converged, found.at_zero) == (True, at_zero)
    assert len(steps) < MAX_STEPS / 2
    assert found.factor[at_zero.index(True)] < 0.25
    assert found.factor[at_zero.index(False)] == pytest.approx(1.0, abs=4.0 * np.max(found.factor_sigma))


def test_a_small_source_that_is_there_is_not_at_zero():
    found = estimate(drawn(6e-7, 2e-6, n=1000))
    assert found.converged
    assert found.at_zero == (False, False)
    assert abs(found.factor[0] - 0.2) < 4.0 * found.factor_sigma[0]


@pytest.mark.parametrize("assumed", [(3e-5, 2e-7), (1e-7, 5e-5), (1e-7, 1e-7), (1e-4, 1e-4)])
def test_priors_that_are_wrong_by_far_are_left_behind(assumed):
    found = estimate(drawn(3e-6, 2e-6, assumed))
    assert found.converged
    right = np.array([3e-6, 2e-6]) / assumed
    assert np.all(np.abs(found.factor / right - 1.0) < 0.25)


def test_a_start_near_the_end_saves_steps_and_changes_nothing(monkeypatch):
    rows = drawn(5e-6, 1e-6)
    first = estimate(rows)
    steps = []
    monkeypatch.setattr(variance, "score_at", lambda *args: steps.append(0) or score_at(*args))
    again = estimate(rows, first)
    assert len(steps) == 1
    np.testing.assert_allclose(again.log_variance, first.log_variance, atol=1e-5)


def test_rows_that_are_turned_already_give_the_same():
    rows = drawn(5e-6, 1e-6)
    np.testing.assert_allclose(estimate(rows).log_variance, estimate_turned(rows).log_variance, rtol=1e-12)


def estimate_turned(rows):
    nothing = np.zeros(rows.jacobian.shape[-1])
    return variance.estimate((independent(rows),), 2, nothing, nothing)
