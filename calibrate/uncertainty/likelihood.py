"""How probable the readings are at the end of a fit: -2 log L of the normal law under the noise that was found.

-2 ln L = r'r + ln det C + m ln 2 pi for m readings in m or rad with misfit covariance C, and whitened misfit r. Rows of
priors are not part of it. Values compare between fits of the same readings.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.joint_problem import Block

Floats = NDArray[np.float64]


def minus_2_log_likelihood(problem: Block, theta: Floats) -> float:
    """At theta (param,); nan where it is not finite."""
    residual = problem.residual(theta)
    value = float(residual @ residual) + problem.log_det_noise + len(residual) * float(np.log(2.0 * np.pi))
    return value if np.isfinite(value) else float("nan")
