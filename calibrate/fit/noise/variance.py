"""Sizes of several sources of noise at once, over several instruments, by restricted maximum likelihood (REML).

What is found is the variance of each source over the assumed one: joint repeatability mapped through the arm, the
detectors' own noise, ... The assumed sizes are the start and hold the answer by a wide prior. Sources: Patterson,
Thompson, Biometrika 58(3), 1971 (REML); Satterthwaite's degrees of freedom: Fai, Cornelius, J. Statist. Comput. Simul.
54, 1996.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.noise.restricted_likelihood import (
    FIXED,
    IndependentRows,
    NoisyRows,
    Score,
    covariance_of,
    independent,
    score_at,
)

__all__ = ["FIXED", "NoisyRows", "VarianceFactors", "as_assumed", "covariance_of", "dof", "estimate"]

Floats = NDArray[np.float64]

LOG_VARIANCE_PRIOR = 2.0 * np.log(4.0)  # assumed noise is often wrong by 1.5 to 8 times: one sigma is a factor 4
STEP_LIMIT = 1.5  # of the log variance in one step
MAX_STEPS = 30
SEPARABLE = 2.0  # of its own sigmas: a smaller variance cannot be separated from none
TOLERANCE = 2e-3  # of the log variance in a last step of Newton's; a quarter of its square is left: 1e-6 of a sigma


@dataclass(frozen=True)
class VarianceFactors:
    """Estimated variance over assumed variance, of each source."""

    log_variance: Floats  # (source,)
    covariance: Floats  # (source, source) of the log variances
    converged: bool
    at_zero: tuple[bool, ...]  # (source,) too small to be separated from none: a bound, not a size

    @property
    def factor(self) -> Floats:
        """(source,) standard deviation over assumed standard deviation."""
        return np.exp(self.log_variance / 2.0)

    @property
    def factor_sigma(self) -> Floats:
        """(source,) one sigma of `factor`, to first order."""
        return self.factor * np.sqrt(np.diag(self.covariance)) / 2.0


def as_assumed(sources: int) -> VarianceFactors:
    """Every source as large as assumed, and as uncertain."""
    return VarianceFactors(
        np.zeros(sources), LOG_VARIANCE_PRIOR**2 * np.eye(sources), converged=True, at_zero=(False,) * sources
    )


def estimate(
    rows: Sequence[NoisyRows | IndependentRows],
    sources: int,
    prior_information: Floats,
    prior_gradient: Floats,
    start: VarianceFactors | None = None,
) -> VarianceFactors:
    """REML for residuals at (or near) the estimate. A source that is not there ends small and converged, `at_zero`.

    `prior_information` (param,) is 1/sigma^2 (0: none), `prior_gradient` (param,) that times the deviation from it.
    `start` saves steps and changes nothing else. UndeterminedError where a combination of parameters is open.
    """
    turned = [independent(each) for each in rows]
    log_variance = np.zeros(sources) if start is None else start.log_variance
    for _ in range(MAX_STEPS):
        score = score_at(turned, log_variance, prior_information, prior_gradient)
        step, newton = _step(score, log_variance)
        log_variance = log_variance + step
        if newton and np.max(np.abs(step)) < TOLERANCE:
            return _found(score, log_variance, converged=True)
    return _found(score_at(turned, log_variance, prior_information, prior_gradient), log_variance, converged=False)


def dof(rows: Sequence[NoisyRows | IndependentRows], prior_information: Floats, factors: VarianceFactors) -> Floats:
    """(param,) Satterthwaite degrees of freedom of each posterior variance, given how well the noise is known."""
    nothing = np.zeros(len(prior_information))
    score = score_at([independent(each) for each in rows], factors.log_variance, prior_information, nothing)
    sensitivity = score.sensitivity()
    variance = np.einsum("ik,kl,il->i", sensitivity, factors.covariance, sensitivity)
    with np.errstate(divide="ignore"):
        return 2.0 * score.posterior_variance() ** 2 / variance


def _step(score: Score, log_variance: Floats) -> tuple[Floats, bool]:
    """Newton's (True) where likelihood and prior are concave, which also ends for a source that is not there.

    Else by scoring, which knows no curvature of a source with a small share, and would jump across the end for ever.
    """
    by_prior = np.eye(len(log_variance)) / LOG_VARIANCE_PRIOR**2
    newton = _positive(score.observed + by_prior)
    information = (score.observed if newton else score.expected) + by_prior
    step = np.linalg.solve(information, score.gradient - by_prior @ log_variance)
    return np.clip(step, -STEP_LIMIT, STEP_LIMIT), newton


def _positive(symmetric: Floats) -> bool:
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        return False
    return True


def _found(score: Score, log_variance: Floats, *, converged: bool) -> VarianceFactors:
    """At zero: smaller than assumed, and by the data fewer than `SEPARABLE` of its sigmas above none."""
    by_prior = 1.0 / LOG_VARIANCE_PRIOR**2
    covariance = np.asarray(np.linalg.inv(score.expected + by_prior * np.eye(len(log_variance))), dtype=np.float64)
    unseen = (np.diag(score.expected) < SEPARABLE**2) & (log_variance < 0.0)
    return VarianceFactors(log_variance, covariance, converged, tuple(unseen.tolist()))
