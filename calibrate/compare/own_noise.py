"""A difference against its own scatter, whatever noise was assumed: means that are not zero, rows that hang together.

Mean: Student's t. Neighbours: von Neumann's ratio of mean square successive difference to variance (Ann. Math.
Stat. 12, 1941) with its normal limit; noise of one sample knows nothing of the sample before.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

Floats = NDArray[np.float64]

FEWEST = 12  # rows of a channel


def scatter_of(own: Floats) -> Floats:
    """(channel,) sigma of a row from its neighbours: slow differences do not count; NaN for too few."""
    return np.array([_scatter(c[np.isfinite(c)]) for c in own.T])


def chance_of_structure(own: Floats) -> float:
    """Of white noise of any size looking like this in any channel; 1 where rows are too few."""
    each = [_chance(channel[np.isfinite(channel)]) for channel in own.T]
    return float(min(1.0, len(each) * min(each, default=1.0)))


def _scatter(x: Floats) -> float:
    return float(np.sqrt(0.5 * np.mean(np.diff(x) ** 2))) if len(x) > 1 else float("nan")


def _chance(x: Floats) -> float:
    n = len(x)
    if n < FEWEST:
        return 1.0
    spread = float(x.std(ddof=1))
    if spread <= 1e-12 * float(np.max(np.abs(x))):
        return 0.0 if np.any(x != 0.0) else 1.0  # one and the same difference in every row
    mean = 2.0 * float(student.sf(abs(float(x.mean())) / spread * np.sqrt(n), n - 1))
    ratio = float(np.sum(np.diff(x) ** 2)) / float(np.sum((x - x.mean()) ** 2))
    below = (2.0 - ratio) / np.sqrt(4.0 * (n - 2) / (n**2 - 1))
    return 2.0 * min(mean, float(norm.sf(below)), 0.5)
