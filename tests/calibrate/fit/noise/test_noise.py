"""Variance components: both sizes found from residuals, honestly, however wrong the belief."""

import numpy as np
import pytest

from calibrate.fit.noise import variance
from calibrate.fit.noise.variance import NoisyRows
from calibrate.model.problem import parts_of


def draw(rng, n, joint_rad, psd_m, columns=10):
    """Residuals of `n` poses after a linear fit with `columns` parameters."""
    by_joint = rng.normal(0, 0.5, (n, 4, 6))
    J = rng.normal(size=(n, 4, columns))
    misfit = np.einsum("nij,nj->ni", by_joint, rng.normal(0, joint_rad, (n, 6))) + rng.normal(0, psd_m, (n, 4))
    misfit += J @ rng.normal(0, 1e-3, columns)
    return misfit, J, by_joint


@pytest.mark.parametrize(("joint_rad", "psd_m"), [(3e-6, 2e-6), (1e-5, 4e-7), (8e-7, 8e-6)])
def test_both_components_are_found_from_a_wrong_prior(joint_rad, psd_m):
    misfit, J, by_joint = draw(np.random.default_rng(7), 300, joint_rad, psd_m)
    parts = parts_of(by_joint, 3e-6, np.full((300, 4), 2e-6))
    found = variance.estimate((NoisyRows(misfit, J, parts, (0, 1)),), 2, np.zeros(10), np.zeros(10))
    assert found.converged
    truth = np.array([joint_rad / 3e-6, psd_m / 2e-6])
    assert np.all(np.abs(found.factor - truth) < 4.0 * found.factor_sigma)
    large = truth > 0.5
    assert np.all(found.factor_sigma[large] < 0.1 * found.factor[large])


def test_restricted_likelihood_is_not_biased_by_many_parameters():
    factors = []
    for seed in range(60):
        misfit, J, by_joint = draw(np.random.default_rng(seed), 20, 3e-6, 2e-6, columns=40)
        parts = parts_of(by_joint, 3e-6, np.full((20, 4), 2e-6))
        rows = NoisyRows(misfit, J, parts, (0, 1))
        factors.append(variance.estimate((rows,), 2, np.zeros(40), np.zeros(40)).log_variance)
    total_power = np.mean(np.sum(np.exp(factors), axis=1)) / 2.0
    assert total_power == pytest.approx(1.0, abs=0.12)  # plain maximum likelihood would give one half


def test_few_residuals_leave_the_noise_uncertain_and_widen_sigma():
    few, many = (_degrees_of_freedom(n) for n in (12, 300))
    assert few < 60
    assert many > 200


def _degrees_of_freedom(n):
    misfit, J, by_joint = draw(np.random.default_rng(8), n, 3e-6, 2e-6)
    parts = parts_of(by_joint, 3e-6, np.full((n, 4), 2e-6))
    found = variance.estimate((NoisyRows(misfit, J, parts, (0, 1)),), 2, np.zeros(10), np.zeros(10))
    return float(np.median(variance.dof((NoisyRows(misfit, J, parts, (0, 1)),), np.zeros(10), found)))
