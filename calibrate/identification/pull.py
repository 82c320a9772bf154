"""How far an unseen combination can pull on each parameter: which of its members have a number all the same.

What the data do not see is known no better than to its plausible size. A parameter that has a share of 1e-4 in it moves
by 1e-4 of its own plausible size when the combination moves by all of that: it is determined, and what little it is
pulled goes into its sigma. Where a combination bends (calibrate/unseen_along.py) the largest pull on its way counts.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.identifiability import STRUCTURAL, WEAK, Identifiability
from calibrate.parameters import Parameter, plausible_sizes, priors
from calibrate.problem import LeastSquares
from calibrate.solvers.linear import triangle_of
from calibrate.unseen_along import points_along

Floats = NDArray[np.float64]

TOLD = 0.05  # of the plausible size: a member of an unseen combination that can move no further is a number
FAR = 3.0  # plausible sizes that the truth of an unseen combination may lie from where it was held


def pull_of_unseen(jacobian: Floats, parameters: tuple[Parameter, ...]) -> Floats:
    """(param,) in its unit, for the whitened Jacobian (row, param): one sigma of what unseen combinations add.

    Rank and scaling are those of identifiability.analyse.
    """
    free = np.flatnonzero([p.free for p in parameters])
    scale, prior = plausible_sizes(parameters)[free], priors(parameters)[free]
    rows = np.concatenate([jacobian[:, free] * scale, np.diag(scale / prior)])
    _, s, Vt = np.linalg.svd(triangle_of(rows))
    unseen = Vt[s <= max(WEAK, STRUCTURAL * s[0])]
    out = np.zeros(len(parameters))
    out[free] = FAR * scale * np.linalg.norm(unseen, axis=0)
    return out


def pull_along(
    problem: LeastSquares, theta: Floats, parameters: tuple[Parameter, ...], seen: Identifiability
) -> Floats:
    """(param,) the same, the largest at `theta` and on the way along what is `seen` as unseen there."""
    points = (theta, *points_along(seen, theta, parameters))
    return np.max([pull_of_unseen(problem.jacobian(point), parameters) for point in points], axis=0)
