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
DAMPING = 1e-6  # of the mean square of a column: a direction that nothing tells stays where it started


def least_distance(rows: Callable[[Floats], tuple[Floats, Floats]], start: Floats) -> tuple[Floats, Floats]:
    """(unknowns (n,), distance (row,)) where `rows` gives residual (row,) and slope (row, n) at unknowns (n,)."""
    best, at = np.full(1, np.inf), start
    x = start
    for _ in range(TURNS):
        residual, slope = rows(x)
        distance = np.abs(residual)
        if np.sum(distance) < np.sum(best):
            best, at = distance, x
        weight = weights(distance)
        normal = slope.T @ (weight[:, None] * slope)
        normal += DAMPING * (np.trace(normal) / len(x) + 1e-300) * np.eye(len(x))
        x = x - np.linalg.solve(normal, slope.T @ (weight * residual))
    return at, best


def weights(distance: Floats) -> Floats:
    """(row,) one over distances (row,)."""
    ordered = np.sort(distance)  # numpy.median costs ten times as much on so few
    median = 0.5 * float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])
    return np.asarray(1.0 / np.maximum(distance, FLOOR * median + 1e-12))
