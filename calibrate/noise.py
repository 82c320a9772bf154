"""Noise of a dual-PSD observation: joint repeatability seen through the arm, and noise of the detectors.

cov_j = joint^2 G_j G_j' + psd^2 diag(w_j^2), G_j = d spots / d joints (4, joint), w_j the stated sigma of the spots.
Both factors are estimated from the residuals by restricted maximum likelihood (REML), from the believed values as
start and as a wide prior. Sources: Patterson, Thompson, Biometrika 58(3), 1971 (REML); Searle, Casella, McCulloch,
Variance Components, 1992, ch. 6.6 (score and information). Satterthwaite's degrees of freedom: Fai, Cornelius, J.
Statist. Comput. Simul. 54, 1996.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.problem import whitener_of

Floats = NDArray[np.float64]

LOG_VARIANCE_PRIOR = 2.0 * np.log(4.0)  # believed noise is often wrong by 1.5 to 8 times: one sigma is a factor 4
STEP_LIMIT = 1.5  # of the log variance in one scoring step
MAX_STEPS = 30
TOLERANCE = 1e-3  # of the log variance: 0.05 % of a sigma


@dataclass(frozen=True)
class NoiseModel:
    """Believed sizes; the data correct them."""

    joint_rad: float
    psd_m: Floats  # (pose, 4) stated sigma of the averaged spots

    def parts(self, by_joint: Floats) -> Floats:
        """(2, pose, 4, 4) covariance by joints and by detectors at the believed sizes, from d spots / d joints."""
        arm = self.joint_rad**2 * by_joint @ np.swapaxes(by_joint, 1, 2)
        psd = np.zeros_like(arm)
        psd[:, range(4), range(4)] = self.psd_m**2
        return np.stack([arm, psd])


@dataclass(frozen=True)
class VarianceFactors:
    """Estimated variance over believed variance, for joints and detectors."""

    log_variance: Floats  # (2,)
    covariance: Floats  # (2, 2) of the log variances
    converged: bool

    @property
    def factor(self) -> Floats:
        """(2,) standard deviation over believed standard deviation."""
        return np.exp(self.log_variance / 2.0)

    @property
    def factor_sigma(self) -> Floats:
        """(2,) one sigma of `factor`, to first order."""
        return self.factor * np.sqrt(np.diag(self.covariance)) / 2.0


BELIEVED = VarianceFactors(np.zeros(2), np.diag([LOG_VARIANCE_PRIOR**2] * 2), True)


def total(parts: Floats, factors: VarianceFactors) -> Floats:
    """(pose, 4, 4) covariance of the noise."""
    return np.einsum("k,knij->nij", np.exp(factors.log_variance), parts)


@dataclass(frozen=True)
class _Score:
    gradient: Floats  # (2,) of the restricted log likelihood by log variance
    information: Floats  # (2, 2) expected
    sensitivity: Floats  # (param, 2) derivative of each posterior variance by log variance


def estimate(
    misfit: Floats, jacobian: Floats, parts: Floats, prior_information: Floats, prior_gradient: Floats
) -> VarianceFactors:
    """REML for residuals (pose, 4) linearised with `jacobian` (pose, 4, param) of the free parameters.

    `prior_information` (param,) is 1/sigma^2 (0: none), `prior_gradient` (param,) that times the deviation from it.
    """
    log_variance, information, converged = np.zeros(2), np.eye(2), False
    for _ in range(MAX_STEPS):
        score = _score(misfit, jacobian, parts, prior_information, prior_gradient, log_variance)
        information = score.information + np.eye(2) / LOG_VARIANCE_PRIOR**2
        step = np.linalg.solve(information, score.gradient - log_variance / LOG_VARIANCE_PRIOR**2)
        step = np.clip(step, -STEP_LIMIT, STEP_LIMIT)
        log_variance = log_variance + step
        if converged := bool(np.max(np.abs(step)) < TOLERANCE):
            break
    covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
    return VarianceFactors(log_variance, covariance, converged)


def variance_doubt(
    misfit: Floats, jacobian: Floats, parts: Floats, prior_information: Floats, factors: VarianceFactors
) -> Floats:
    """(param,) Satterthwaite degrees of freedom of each posterior variance, given how well the noise is known."""
    zero = np.zeros(jacobian.shape[2])
    score = _score(misfit, jacobian, parts, prior_information, zero, factors.log_variance)
    variance = np.einsum("ik,kl,il->i", score.sensitivity, factors.covariance, score.sensitivity)
    posterior = np.diag(_posterior(_whitened(jacobian, parts, factors.log_variance)[1], prior_information))
    with np.errstate(divide="ignore"):
        return 2.0 * posterior**2 / variance


def _whitened(jacobian: Floats, parts: Floats, log_variance: Floats) -> tuple[Floats, Floats, Floats]:
    """Whitener (pose, 4, 4), whitened Jacobian (pose, 4, param), whitened parts (2, pose, 4, 4)."""
    scaled = np.exp(log_variance)[:, None, None, None] * parts
    W = whitener_of(scaled.sum(axis=0))
    return W, W @ jacobian, W @ scaled @ np.swapaxes(W, 1, 2)


def _posterior(J: Floats, prior_information: Floats) -> Floats:
    flat = J.reshape(-1, J.shape[-1])
    scale = 1.0 / np.sqrt(np.einsum("ij,ij->j", flat, flat) + prior_information)  # symmetric scaling: less rounding
    normal = (flat * scale).T @ (flat * scale) + np.diag(prior_information * scale**2)
    return np.linalg.inv(normal) * np.outer(scale, scale)


def _score(
    misfit: Floats,
    jacobian: Floats,
    parts: Floats,
    prior_information: Floats,
    prior_gradient: Floats,
    log_variance: Floats,
) -> _Score:
    W, J, B = _whitened(jacobian, parts, log_variance)
    C = _posterior(J, prior_information)
    r = np.einsum("nij,nj->ni", W, misfit)
    shift = -C @ (np.einsum("nip,ni->p", J, r) + prior_gradient)
    e = r + J @ shift  # residual of the best fit under these variances
    p = J.shape[-1]
    BJ = B @ J  # (2, pose, 4, param)
    flat_J, flat_BJ = J.reshape(-1, p), BJ.reshape(2, -1, p)
    A = flat_J.T @ flat_BJ  # (2, param, param)
    CA = C @ A
    squared = np.einsum("ni,knij,nj->k", e, B, e)
    trace = np.einsum("knii->k", B) - np.einsum("kii->k", CA)
    cross = flat_BJ.reshape(2, -1) @ (flat_BJ @ C).reshape(2, -1).T
    information = 0.5 * (np.einsum("knij,lnij->kl", B, B) - 2.0 * cross + np.einsum("kij,lji->kl", CA, CA))
    return _Score(0.5 * (squared - trace), information, np.einsum("kij,ij->ik", CA, C))
