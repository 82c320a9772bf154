"""What the readings leave over to check the fit: as many degrees of freedom as their residuals truly have.

Readings less the sum of their leverages, m - tr(J C J'). Without priors this is equations less unknowns. A prior takes
part of an unknown off the readings, so that rows of [tolerance] are not counted as if somebody had measured them.
Sources: Hoaglin, Welsch, Am. Stat. 32(1), 1978 (leverage); Ye, J. Am. Stat. Assoc. 93, 1998 (degrees of freedom).
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.problem import LeastSquares

Floats = NDArray[np.float64]

# Below, 95 % of the scatters that belong to one noise span a factor of four (chi-square of 5: 0.83 to 12.8): the
# residuals can neither show noise nor a wrong model.
FEWEST_SPARE = 5.0


def spare_readings(problem: LeastSquares, theta: Floats, covariance: Floats) -> float:
    """Of a fit that ended at theta (param,) with this posterior (param, param); nan where it does not exist."""
    slope = problem.jacobian(theta)
    free = np.flatnonzero(np.diag(covariance) > 0.0)
    if not np.all(np.isfinite(covariance)):
        return float("nan")
    return float(len(slope) - np.sum((slope[:, free] @ covariance[np.ix_(free, free)]) * slope[:, free]))


def checks_nothing(spare: float) -> bool:
    """Whether nothing worth mentioning is left over."""
    return spare < FEWEST_SPARE
