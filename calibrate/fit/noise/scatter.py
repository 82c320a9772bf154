"""Size and form of one instrument's noise, and how far each observation is trusted, from the residuals alone.

Two forms compete by likelihood: one covariance for all observations (an instrument's own noise, whatever its axes), and
repeatability of the joints seen through the arm plus the assumed own noise (a pose with a long lever scatters more).
Both under Student's t law with 5 degrees of freedom, by expectation-maximisation. Source: Lange, Little, Taylor, Robust
Statistical Modeling Using the t Distribution, J. Am. Stat. Assoc. 84(408), 1989, sections 2 and 3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

Floats = NDArray[np.float64]

NU = 5.0  # degrees of freedom: a tenth less efficient than least squares on Gaussian data, safe against outlying rows
TURNS = 20
SETTLED = 1e-4  # of -2 log L per observation
FLOOR = 1e-6  # of the assumed noise: perfect data have a scale, too
ROUNDING = 1e-14  # of the largest variance: fewer rows than columns, or one bound to others, leave directions without
MEDIAN_OF_SIZES = 0.6745  # of |x|, x normal with sigma 1
LOG_RATIO = (-18.0, 18.0)  # of variance by joints over own variance, as assumed both


@dataclass(frozen=True)
class Scatter:
    """Noise of one instrument's observations."""

    covariance: Floats  # (row, k, k) scale of the t law
    weights: Floats  # (row,) 1 is fully trusted
    minus_two_log_likelihood: float
    free: int  # numbers estimated


def sigma_about_zero(values: Floats, axis: int | None = None) -> Floats:
    """One sigma of normal noise of mean zero from the median of |values|; gross errors hardly change it.

    Of all `values` (any shape), or along `axis`, in their unit. A common offset counts as noise: subtract it before.
    Source: Huber, Ronchetti, Robust Statistics, 2nd ed. 2009, chapter 5 (the median absolute deviation, about zero).
    """
    return np.asarray(np.median(np.abs(values), axis=axis) / MEDIAN_OF_SIZES, dtype=np.float64)


def scatter_of(residual: Floats, by_joint: Floats, own_sigma: Floats) -> Scatter:
    """Of residuals (row, k) with d reading / d joints (row, k, readings) and assumed own noise (row, k)."""
    if len(residual) == 0:  # all rows of the instrument are held out
        return Scatter(np.zeros((0, residual.shape[1], residual.shape[1])), np.zeros(0), 0.0, 0)
    one, other = _of_one_form(residual, own_sigma), _through_joints(residual, by_joint, own_sigma)
    cost = np.log(max(len(residual), 2))
    first = one.minus_two_log_likelihood + cost * one.free
    return one if first <= other.minus_two_log_likelihood + cost * other.free else other


def likelihood_of(residual: Floats, covariance: Floats) -> tuple[float, Floats]:
    """-2 log L under Student's t with scale (row, k, k), and the weights (row,)."""
    k = residual.shape[1]
    L = np.linalg.cholesky(covariance)
    z = np.linalg.solve(L, residual[..., None])[..., 0]
    square = np.sum(z**2, axis=1)
    log_det = 2.0 * np.sum(np.log(np.diagonal(L, axis1=1, axis2=2)), axis=1)
    constant = -2.0 * (gammaln((NU + k) / 2.0) - gammaln(NU / 2.0)) + k * np.log(NU * np.pi)
    each = constant + log_det + (NU + k) * np.log1p(square / NU)
    return float(np.sum(each)), (NU + k) / (NU + square)


def _of_one_form(residual: Floats, own_sigma: Floats) -> Scatter:
    n, k = residual.shape
    z = residual / own_sigma
    form, last = np.diag((sigma_about_zero(z, axis=0) + FLOOR) ** 2), np.inf
    for _ in range(TURNS):
        L = np.linalg.cholesky(form)
        square = np.sum(np.linalg.solve(L, z.T) ** 2, axis=0)
        value = _law(square, k) + n * 2.0 * float(np.sum(np.log(np.diag(L))))
        if last - value < SETTLED * n:
            break
        last, weights = value, (NU + k) / (NU + square)
        form = (weights[:, None] * z).T @ z / n
        form += max(FLOOR**2, ROUNDING * float(np.trace(form))) * np.eye(k)
    value, weights = likelihood_of(z, np.broadcast_to(form, (n, k, k)))
    covariance = form * own_sigma[:, :, None] * own_sigma[:, None, :]
    return Scatter(covariance, weights, value + 2.0 * float(np.sum(np.log(own_sigma))), k * (k + 1) // 2)


def _law(square: Floats, k: int) -> float:
    """-2 log L of whitened squares (row,) of k values each, without the determinant of what whitened them."""
    constant = -2.0 * (gammaln((NU + k) / 2.0) - gammaln(NU / 2.0)) + k * np.log(NU * np.pi)
    return float(len(square) * constant + (NU + k) * np.sum(np.log1p(square / NU)))


def _through_joints(residual: Floats, by_joint: Floats, own_sigma: Floats) -> Scatter:
    """In axes in which both parts are diagonal, so that a ratio costs no decomposition."""
    n, k = residual.shape
    size = float(np.mean(own_sigma**2))
    arm = by_joint @ np.swapaxes(by_joint, 1, 2)
    arm = arm * (k * size / max(np.trace(arm, axis1=1, axis2=2).mean(), 1e-300))
    w, V = np.linalg.eigh(arm / (own_sigma[:, :, None] * own_sigma[:, None, :]))
    turned = np.einsum("nij,ni->nj", V, residual / own_sigma) ** 2

    def spread(log_ratio: float) -> tuple[Floats, float]:
        """(row, k) of the axes, and the scale that belongs to the ratio."""
        ratio = np.exp(log_ratio)
        axes = (1.0 + ratio * np.maximum(w, 0.0)) / (1.0 + ratio)
        square = (turned / axes).sum(axis=1)
        scale = max(float(np.median(square)) / k, FLOOR**2)
        for _ in range(TURNS):
            new = max(float((square * (NU + k) / (NU + square / scale)).sum()) / (n * k), FLOOR**2)
            settled, scale = abs(np.log(new / scale)) < SETTLED, new
            if settled:
                break
        return axes, scale

    def cost(log_ratio: float) -> float:
        axes, scale = spread(log_ratio)
        return _law(np.sum(turned / (scale * axes), axis=1), k) + float(np.sum(np.log(scale * axes)))

    from scipy.optimize import fminbound  # a fit of geometry alone does without, and starts sooner

    best: float = fminbound(cost, LOG_RATIO[0], LOG_RATIO[1], xtol=0.05)  # pyright: ignore[reportAssignmentType]
    scale, ratio = spread(best)[1], np.exp(best)
    own = np.zeros((n, k, k))
    own[:, range(k), range(k)] = own_sigma**2
    form = (own + ratio * arm) / (1.0 + ratio)
    value, weights = likelihood_of(residual, scale * form)
    return Scatter(scale * form, weights, value, 2)
