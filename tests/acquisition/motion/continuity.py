"""How far position, speed and acceleration of a curve differ before and after a moment."""

from collections.abc import Callable, Sequence

import numpy as np

APART_S = 3e-3
POINTS = 6


def jumps(curve: Callable[[float], np.ndarray], moments_s: Sequence[float]) -> np.ndarray:
    """(moment, 3) largest jump of any coordinate in position, speed and acceleration.

    `curve` is asked forwards in time; each side is the polynomial through its own six points.
    """
    steps = np.arange(POINTS) * APART_S
    out = []
    for moment in moments_s:
        before = np.array([curve(t) for t in moment - 1e-9 - steps[::-1]])
        after = np.array([curve(t) for t in moment + 1e-9 + steps])
        out.append(
            [np.abs(a - b).max() for a, b in zip(_taylor(before, -steps[::-1]), _taylor(after, steps), strict=True)]
        )
    return np.array(out)


def _taylor(values: np.ndarray, times: np.ndarray) -> list[np.ndarray]:
    """Value, slope and curvature at time 0."""
    powers = np.vander(times / APART_S, POINTS, increasing=True)
    coefficients = np.linalg.solve(powers, values)
    return [coefficients[0], coefficients[1] / APART_S, 2.0 * coefficients[2] / APART_S**2]
