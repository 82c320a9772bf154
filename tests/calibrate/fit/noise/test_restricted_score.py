"""Slope and curvature of the restricted likelihood against its plain formula with whole matrices."""

from dataclasses import dataclass

import numpy as np
import pytest

from calibrate.errors import DataError, naming_undetermined
from calibrate.fit.noise.restricted_likelihood import (
    FIXED,
    NoisyRows,
    covariance_of,
    independent,
    score_at,
)

ROWS, PARAMS = 14, 9


@dataclass(frozen=True)
class Plain:
    """Everything at once: all residuals in one vector, every source as one whole matrix, priors as more rows."""

    misfit: np.ndarray
    jacobian: np.ndarray
    parts: list[np.ndarray]  # of each source
    fixed: np.ndarray

    def log_likelihood(self, log_variance):
        """Patterson and Thompson 1971: what is left when the parameters have been integrated out."""
        V = self.covariance(log_variance)
        weight = np.linalg.inv(V)
        normal = self.jacobian.T @ weight @ self.jacobian
        best = -np.linalg.solve(normal, self.jacobian.T @ weight @ self.misfit)
        e = self.misfit + self.jacobian @ best
        return -0.5 * (np.linalg.slogdet(V)[1] + np.linalg.slogdet(normal)[1] + e @ weight @ e)

    def covariance(self, log_variance):
        return self.fixed + sum(np.exp(one) * part for one, part in zip(log_variance, self.parts, strict=True))

    def expected(self, log_variance):
        """tr(P V_c P V_d) / 2 with the projector P of Searle, Casella, McCulloch 1992, ch. 6.6."""
        weight = np.linalg.inv(self.covariance(log_variance))
        WX = weight @ self.jacobian
        P = weight - WX @ np.linalg.solve(self.jacobian.T @ WX, WX.T)
        scaled = [np.exp(one) * part for one, part in zip(log_variance, self.parts, strict=True)]
        return np.array([[0.5 * np.trace(P @ a @ P @ b) for b in scaled] for a in scaled])


def semidefinite(rng, n, k, rank):
    factor = rng.normal(size=(n, k, rank))
    return factor @ np.swapaxes(factor, 1, 2)


def instrument(rng, k, sources):
    ranks = [k] + [max(k - 1, 1)] * (len(sources) - 1)
    parts = np.stack([semidefinite(rng, ROWS, k, rank) for rank in ranks])
    return NoisyRows(rng.normal(size=(ROWS, k)), rng.normal(size=(ROWS, k, PARAMS)), parts, sources)


CASES = {
    "spots: joints and detectors": [(4, (0, 1))],
    "one coordinate, three sources": [(1, (0, 1, 2))],
    "blocks that no turn makes independent": [(3, (0, 1, 2))],
    "a stated part beside a found one": [(3, (FIXED, 0))],
    "several instruments that share the joints, and a certificate": [(4, (0, 1)), (1, (0, 2)), (1, (FIXED,))],
    "blocks beside independent rows": [(6, (0, 1, 2)), (3, (0, 3)), (2, (0,))],
}


@pytest.fixture(params=CASES.values(), ids=CASES.keys())
def case(request):
    """Rows, how many sources, priors on some of the parameters, and the same as whole matrices."""
    rng = np.random.default_rng(5)
    rows = [instrument(rng, k, sources) for k, sources in request.param]
    sources = 1 + max(source for each in rows for source in each.sources)
    information = np.where(np.arange(PARAMS) % 3 == 0, 4.0, 0.0)
    deviation = rng.normal(size=PARAMS)
    return rows, sources, information, deviation, whole(rows, sources, information, deviation)


def whole(rows, sources, information, deviation):
    with_prior = np.flatnonzero(information)
    misfit = np.concatenate([*(each.misfit.ravel() for each in rows), deviation[with_prior]])
    jacobian = np.concatenate([*(each.jacobian.reshape(-1, PARAMS) for each in rows), np.eye(PARAMS)[with_prior]])
    parts, fixed = [np.zeros((len(misfit), len(misfit))) for _ in range(sources)], np.zeros((len(misfit), len(misfit)))
    first = 0
    for each in rows:
        k = each.misfit.shape[1]
        for part, source in zip(each.parts, each.sources, strict=True):
            into = fixed if source == FIXED else parts[source]
            for j in range(ROWS):
                at = slice(first + k * j, first + k * (j + 1))
                into[at, at] += part[j]
        first += ROWS * k
    prior = np.arange(first, len(misfit))
    fixed[prior, prior] = 1.0 / information[with_prior]
    return Plain(misfit, jacobian, parts, fixed)


def differences(function, at, size=1e-4):
    return np.array([(function(at + step) - function(at - step)) / (2.0 * size) for step in size * np.eye(len(at))])


@pytest.mark.parametrize("turned", [False, True])
def test_slope_and_curvatures_are_those_of_the_plain_formula(case, turned):
    rows, sources, information, deviation, plain = case
    given = [independent(each) for each in rows] if turned else rows
    at = np.random.default_rng(6).normal(0, 0.5, sources)

    def score(log_variance):
        return score_at(given, log_variance, information, information * deviation)

    slope = differences(plain.log_likelihood, at)
    np.testing.assert_allclose(score(at).gradient, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())
    np.testing.assert_allclose(score(at).expected, plain.expected(at), rtol=1e-8, atol=1e-10)
    curved = -differences(lambda x: score(x).gradient, at)
    np.testing.assert_allclose(score(at).observed, curved, rtol=1e-6, atol=1e-6 * np.abs(curved).max())


def test_posterior_variances_and_their_derivatives(case):
    rows, sources, information, deviation, plain = case
    at = np.random.default_rng(7).normal(0, 0.5, sources)

    def posterior(log_variance):
        weight = np.linalg.inv(plain.covariance(log_variance))
        return np.diag(np.linalg.inv(plain.jacobian.T @ weight @ plain.jacobian))

    score = score_at([independent(each) for each in rows], at, information, information * deviation)
    np.testing.assert_allclose(score.posterior_variance(), posterior(at), rtol=1e-9)
    slope = differences(posterior, at).T
    np.testing.assert_allclose(score.sensitivity(), slope, rtol=1e-6, atol=1e-7 * np.abs(slope).max())


def test_turned_rows_have_the_same_covariance_under_any_factors():
    rng = np.random.default_rng(8)
    rows = instrument(rng, 4, (0, 1))
    turned = independent(rows)
    for log_variance in rng.normal(0, 3, (5, 2)):
        V = covariance_of(rows.parts, rows.sources, log_variance)
        expected = np.einsum("ni,nij,nj->", rows.misfit, np.linalg.inv(V), rows.misfit)
        found = np.sum(turned.misfit**2 / (np.exp(log_variance) @ turned.parts))
        assert found == pytest.approx(expected, rel=1e-9)


def test_an_open_combination_is_refused():
    rows = instrument(np.random.default_rng(9), 4, (0, 1))
    rows.jacobian[:, :, 3] = 0.0
    with pytest.raises(np.linalg.LinAlgError):
        score_at([independent(rows)], np.zeros(2), np.zeros(PARAMS), np.zeros(PARAMS))
    names, q_rad = [f"p{i}" for i in range(PARAMS)], np.column_stack([np.arange(4.0), np.zeros(4)])
    with (
        pytest.raises(DataError, match=r"not determined by these samples: p3 \(q2_rad = 0 in every row\)"),
        naming_undetermined(names, q_rad),
    ):
        score_at([independent(rows)], np.zeros(2), np.zeros(PARAMS), np.zeros(PARAMS))
