"""Sizes of several sources of noise at once, over several instruments, by restricted maximum likelihood (REML).

Row j of an instrument has covariance sum_c exp(log_variance_c) part_cj: joint repeatability mapped through the arm,
the detectors' own noise, ... Parts are those of the believed sizes, which are the start and hold the answer by a wide
prior. Sources: Patterson, Thompson, Biometrika 58(3), 1971 (REML); Searle, Casella, McCulloch, Variance Components,
1992, ch. 6.6 (score and information). Satterthwaite's degrees of freedom: Fai, Cornelius, J. Statist. Comput. Simul.
54, 1996.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.problem import whitener_of

Floats = NDArray[np.float64]

LOG_VARIANCE_PRIOR = 2.0 * np.log(4.0)  # believed noise is often wrong by 1.5 to 8 times: one sigma is a factor 4
STEP_LIMIT = 1.5  # of the log variance in one scoring step
MAX_STEPS = 30
TOLERANCE = 1e-3  # of the log variance: 0.05 % of a sigma
FIXED = -1  # source of a part that is as large as stated, such as the sigma on a certificate


@dataclass(frozen=True)
class VarianceFactors:
    """Estimated variance over believed variance, of each source."""

    log_variance: Floats  # (source,)
    covariance: Floats  # (source, source) of the log variances
    converged: bool

    @property
    def factor(self) -> Floats:
        """(source,) standard deviation over believed standard deviation."""
        return np.exp(self.log_variance / 2.0)

    @property
    def factor_sigma(self) -> Floats:
        """(source,) one sigma of `factor`, to first order."""
        return self.factor * np.sqrt(np.diag(self.covariance)) / 2.0


def as_believed(sources: int) -> VarianceFactors:
    """Every source as large as believed, and as doubtful."""
    return VarianceFactors(np.zeros(sources), LOG_VARIANCE_PRIOR**2 * np.eye(sources), True)


@dataclass(frozen=True)
class NoisyRows:
    """One instrument's rows, linearised with the free parameters of the whole fit."""

    misfit: Floats  # (row, k)
    jacobian: Floats  # (row, k, param)
    parts: Floats  # (part, row, k, k) covariance at the believed sizes
    sources: tuple[int, ...]  # which source each part belongs to, counted over all instruments, each once; or FIXED


def covariance_of(parts: Floats, sources: Sequence[int], log_variance: Floats) -> Floats:
    """(row, k, k) sum of the parts (part, row, k, k), each times the variance factor of its source."""
    return np.einsum("k,knij->nij", _factors(sources, log_variance), parts)


def _factors(sources: Sequence[int], log_variance: Floats) -> Floats:
    return np.exp(np.append(log_variance, 0.0)[list(sources)])  # FIXED is the last: factor 1


@dataclass(frozen=True)
class _Whitened:
    r: Floats  # (row, k)
    J: Floats  # (row, k, param)
    B: Floats  # (part, row, k, k) of the parts that are not fixed; with the fixed ones they sum to one
    sources: list[int]


@dataclass(frozen=True)
class _Score:
    gradient: Floats  # (source,) of the restricted log likelihood by log variance
    information: Floats  # (source, source) expected
    sensitivity: Floats  # (param, source) derivative of each posterior variance by log variance


def estimate(
    rows: Sequence[NoisyRows], sources: int, prior_information: Floats, prior_gradient: Floats
) -> VarianceFactors:
    """REML for residuals at (or near) the estimate.

    `prior_information` (param,) is 1/sigma^2 (0: none), `prior_gradient` (param,) that times the deviation from it.
    """
    log_variance, information, converged = np.zeros(sources), np.eye(sources), False
    for _ in range(MAX_STEPS):
        score = _score(rows, log_variance, prior_information, prior_gradient)
        information = score.information + np.eye(sources) / LOG_VARIANCE_PRIOR**2
        step = np.linalg.solve(information, score.gradient - log_variance / LOG_VARIANCE_PRIOR**2)
        step = np.clip(step, -STEP_LIMIT, STEP_LIMIT)
        log_variance = log_variance + step
        if converged := bool(np.max(np.abs(step)) < TOLERANCE):
            break
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return VarianceFactors(log_variance, covariance, converged)


def doubt(rows: Sequence[NoisyRows], prior_information: Floats, factors: VarianceFactors) -> Floats:
    """(param,) Satterthwaite degrees of freedom of each posterior variance, given how well the noise is known."""
    zero = np.zeros(len(prior_information))
    score = _score(rows, factors.log_variance, prior_information, zero)
    variance = np.einsum("ik,kl,il->i", score.sensitivity, factors.covariance, score.sensitivity)
    whitened = [_whitened(part, factors.log_variance) for part in rows]
    posterior = np.diag(_posterior(whitened, prior_information))
    with np.errstate(divide="ignore"):
        return 2.0 * posterior**2 / variance


def _whitened(rows: NoisyRows, log_variance: Floats) -> _Whitened:
    scaled = _factors(rows.sources, log_variance)[:, None, None, None] * rows.parts
    W = whitener_of(scaled.sum(axis=0))
    found = [i for i, source in enumerate(rows.sources) if source != FIXED]
    B = W @ scaled[found] @ np.swapaxes(W, 1, 2)
    sources = [rows.sources[i] for i in found]
    return _Whitened(np.einsum("nij,nj->ni", W, rows.misfit), W @ rows.jacobian, B, sources)


def _posterior(whitened: Sequence[_Whitened], prior_information: Floats) -> Floats:
    """(param, param) inverse of the normal matrix, with symmetric scaling: less rounding."""
    flat = [w.J.reshape(-1, w.J.shape[-1]) for w in whitened]
    scale = 1.0 / np.sqrt(sum(np.einsum("ij,ij->j", J, J) for J in flat) + prior_information)
    normal = np.diag(prior_information * scale**2)
    for J in flat:
        normal += (J * scale).T @ (J * scale)
    return np.linalg.inv(normal) * np.outer(scale, scale)


def _score(
    rows: Sequence[NoisyRows], log_variance: Floats, prior_information: Floats, prior_gradient: Floats
) -> _Score:
    n, p = len(log_variance), len(prior_information)
    whitened = [_whitened(part, log_variance) for part in rows]
    C = _posterior(whitened, prior_information)
    shift = -C @ (sum(np.einsum("nip,ni->p", w.J, w.r) for w in whitened) + prior_gradient)
    squared, trace, information, A = np.zeros(n), np.zeros(n), np.zeros((n, n)), np.zeros((n, p, p))
    for w in whitened:
        e = w.r + w.J @ shift  # residual of the best fit under these variances
        BJ = (w.B @ w.J).reshape(len(w.B), -1, p)
        A[w.sources] += w.J.reshape(-1, p).T @ BJ
        squared[w.sources] += np.einsum("ni,knij,nj->k", e, w.B, e)
        trace[w.sources] += np.einsum("knii->k", w.B)
        cross = BJ.reshape(len(BJ), -1) @ (BJ @ C).reshape(len(BJ), -1).T
        information[np.ix_(w.sources, w.sources)] += np.einsum("knij,lnij->kl", w.B, w.B) - 2.0 * cross
    CA = C @ A  # (source, param, param)
    information += np.einsum("kij,lji->kl", CA, CA)
    gradient = 0.5 * (squared - trace + np.einsum("kii->k", CA))
    return _Score(gradient, 0.5 * information, np.einsum("kij,ij->ik", CA, C))
