"""Does what the model leaves depend on something: analysis of variance of residuals by joint angle and by order.

One factor at a time: rows sorted by it into groups of equal size, F of the spread of the group means over the spread
within groups. Source: Fisher; Draper, Smith, Applied Regression Analysis, 3rd ed. 1998, ch. 23 (one-way analysis).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

Floats = NDArray[np.float64]

GROUPS = 12
FEWEST = 5  # rows in a group: a mean of fewer is mostly its own noise
CLEAR_P = 1e-4  # of chance alone: some dozen factors are looked at, so a pattern must be rarer than one in a thousand


@dataclass(frozen=True)
class Pattern:
    """Group means along one factor."""

    factor: str  # "J3", "order in the session"
    middle: Floats  # (group,) median of the factor
    mean: Floats  # (group, k) of the residual
    sigma: Floats  # (group, k) of the mean, from the scatter within the groups
    f: float  # spread of the means over what scatter alone would give: near 1 without a pattern
    p: float  # probability of such an F by chance
    share: float  # of the residual's sum of squares that the group means explain

    @property
    def clear(self) -> bool:
        """Whether chance is no explanation."""
        return self.p < CLEAR_P


def pattern(factor: str, values: Floats, residual: Floats) -> Pattern | None:
    """Of residuals (row, k) along `values` (row,). None with too few rows, or where the factor or residual stands."""
    n, k = residual.shape
    groups = min(GROUPS, n // FEWEST)
    if groups < 2 or np.ptp(values) == 0.0:
        return None
    parts = np.array_split(np.argsort(values, kind="stable"), groups)
    size = np.array([len(rows) for rows in parts])
    mean = np.stack([residual[rows].mean(axis=0) for rows in parts])
    between = float(np.sum(size[:, None] * (mean - residual.mean(axis=0)) ** 2))
    within = np.sum([np.sum((residual[rows] - mean[i]) ** 2, axis=0) for i, rows in enumerate(parts)], axis=0)
    if float(np.sum(within)) <= 0.0:
        return None
    dof, rest = k * (groups - 1), k * (n - groups)
    f = between / dof / (float(np.sum(within)) / rest)
    sigma = np.sqrt(within / (n - groups) / size[:, None])
    middle = np.array([np.median(values[rows]) for rows in parts])
    total = between + float(np.sum(within))
    return Pattern(factor, middle, mean, sigma, f, float(fdtrc(dof, rest, f)), between / total)


def patterns(q_rad: Floats, order: Floats, residual: Floats) -> tuple[Pattern, ...]:
    """Along every joint (row, joint), then along the order of the rows (row,)."""
    factors = [(f"J{j}", q) for j, q in enumerate(q_rad.T, start=1)]
    found = [pattern(name, values, residual) for name, values in (*factors, ("order in the session", order))]
    return tuple(p for p in found if p is not None)
