"""The least sum of distances by Gauss-Newton under Weiszfeld's weights: a few outlying rows do not pull.

Source: Weiszfeld's weights for sums of distances as in Lawson, Hanson, Solving Least Squares Problems, 1974, ch. 25
(iteratively reweighted least squares); damping by Levenberg, Quart. Appl. Math. 2, 1944.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

TURNS = 25  # compared are factors, not digits
FLOOR = 0.05  # of the median distance: closer rows all weigh the same
DAMPING = 1e-6  # of the mean square of a column: a direction that nothing shows stays where it started


def least_distance(rows: Callable[[Floats], tuple[Floats, Floats]], start: Floats) -> tuple[Floats, Floats]:
    """(unknowns (..., n), distance (..., row)) where `rows` gives residual (..., row) and slope (..., row, n) at them.

    Cases before the last axes of `start` (..., n) are solved side by side, each for itself.
    """
    x, at = start, start
    best = np.full((*start.shape[:-1], 1), np.inf)
    for _ in range(TURNS):
        residual, slope = rows(x)
        distance = np.abs(residual)
        better = np.sum(distance, axis=-1, keepdims=True) < np.sum(best, axis=-1, keepdims=True)
        best, at = np.where(better, distance, best), np.where(better, x, at)
        weighed = np.swapaxes(weights(distance)[..., None] * slope, -1, -2)
        normal = damped(weighed @ slope, DAMPING)
        x = x - np.linalg.solve(normal, weighed @ residual[..., None])[..., 0]
    return at, best


def weights(distance: Floats) -> Floats:
    """(..., row) one over distances (..., row), the floor by the median of each row of them."""
    return np.asarray(1.0 / np.maximum(distance, FLOOR * median(distance)[..., None] + 1e-12))


def median(distance: Floats) -> Floats:
    """(...) of distances (..., row); numpy's own costs ten times as much on so few."""
    ordered, n = np.sort(distance, axis=-1), distance.shape[-1]
    return 0.5 * (ordered[..., (n - 1) // 2] + ordered[..., n // 2])


def damped(normal: Floats, damping: float) -> Floats:
    """Normal matrices (..., n, n) with `damping` times the mean square of their columns added to the diagonals."""
    n = normal.shape[-1]
    mean = np.trace(normal, axis1=-2, axis2=-1) / n + 1e-300
    return np.asarray(normal + damping * mean[..., None, None] * np.eye(n))
