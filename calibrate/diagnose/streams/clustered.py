"""Least squares on streams with a sigma that neighbouring samples cannot make too small.

Residuals of a stream hang together: noise is filtered, models are off a little for a while. So whole blocks of time
are left out in turn (jackknife: Efron, SIAM CBMS 38, 1982, chapter 3; with clusters: MacKinnon, Nielsen, Webb, J.
Applied Econometrics 38, 2023). Only blocks are taken as independent:

    V = (B - 1) / B sum_b d_b d_b',  d_b = (H - H_b)^-1 X_b' psi(r_b),  H = X' psi'(r) X

psi is Huber's: rows beyond its bend still pull, but do not hold, so they count in the pull and not in H (Huber 1981,
section 7.6). Its scale is the usual residual of the rows that decide, those with much X: stamps that tremble make
residuals grow with speed, and rows that hardly move would call every fast one wild.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.streams.track import SIGMA_OF_MEDIAN

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

HUBER = 1.345  # sigmas: 95 % efficiency on normal noise (Huber 1981, section 4.5)
SINGULAR = 1e-10  # of the scaled normal matrix: below, a combination is not seen


@dataclass(frozen=True)
class Line:
    """Solution of a linear fit; `covariance` NaN where the data do not determine it."""

    values: Floats
    covariance: Floats
    blocks: int

    @property
    def sigma(self) -> Floats:
        return np.sqrt(np.diag(self.covariance))


def fit(X: Floats, y: Floats, block: Ints, rounds: int = 4) -> Line | None:
    """Robust y = X b. `X` (row, k), `y` (row,), `block` (row,). None where X is singular or blocks are too few."""
    k, blocks = X.shape[1], len(np.unique(block))
    scale = np.linalg.norm(X, axis=0)
    if blocks <= k + 1 or not np.all(scale > 0.0):
        return None
    Z = X / scale
    if np.linalg.eigvalsh(Z.T @ Z)[0] < SINGULAR:
        return None
    weight, holds, b = np.ones(len(y)), np.ones(len(y)), np.zeros(k)
    deciding = np.sum(Z**2, axis=1)
    for again in range(rounds):
        if again:
            residual = y - Z @ b
            spread = SIGMA_OF_MEDIAN * _middle(np.abs(residual), deciding)
            if spread <= 0.0:
                break
            weight = np.minimum(1.0, HUBER * spread / np.maximum(np.abs(residual), 1e-300))
            holds = (weight == 1.0).astype(float)
        normal = Z.T @ (weight[:, None] * Z)
        b = np.linalg.solve(normal, Z.T @ (weight * y))
    residual = y - Z @ b
    covariance = _jackknife(Z, weight * residual, holds, block) / np.outer(scale, scale)
    return Line(b / scale, covariance, blocks)


def _middle(values: Floats, weight: Floats) -> float:
    """Weighted median."""
    order = np.argsort(values)
    passed = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(passed, 0.5 * passed[-1])]])


def _jackknife(Z: Floats, pull: Floats, holds: Floats, block: Ints) -> Floats:
    """Scatter of the solutions that leave one block out; blocks that hold much of the motion count in full."""
    _, at = np.unique(block, return_inverse=True)
    k, blocks = Z.shape[1], int(at.max()) + 1
    sums, own = np.zeros((blocks, k)), np.zeros((blocks, k, k))
    np.add.at(sums, at, Z * pull[:, None])
    np.add.at(own, at, holds[:, None, None] * Z[:, :, None] * Z[:, None, :])
    apart = np.linalg.solve(own.sum(axis=0) - own, sums[:, :, None])[:, :, 0]
    return (blocks - 1) / blocks * apart.T @ apart
