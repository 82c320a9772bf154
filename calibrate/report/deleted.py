"""What each observation is missed by when the fit is made without it, without fitting again.

With whitened residual r and derivative J of one observation and the posterior covariance C of the parameters,
r / (1 - J C J') is its error in the fit of all others: exact for a linear model, to first order for this one.
Source: Cook, Weisberg, Residuals and Influence in Regression, 1982, ch. 2.2 and, for several rows at once, ch. 3.6.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.joint_problem import JointProblem
from calibrate.problem import Problem

Floats = NDArray[np.float64]

ALONE = 1e-6  # of 1 - J C J': below, the observation alone determines something, and nothing else predicts it


def deleted_misfit(problem: JointProblem, index: int, theta: Floats, covariance: Floats) -> Floats | None:
    """(obs, k) misfit of block `index`, in the sensor's unit, each observation left out in turn; NaN where ALONE.

    None for a block whose rows are not readings of their own. `covariance` (param, param) is under the weights of
    `problem`.
    """
    block = problem.blocks[index]
    if not isinstance(block, Problem) or block.correlation is not None or block.condition:
        return None
    shape = block.observed.shape
    J = problem.jacobian_of(index, theta).reshape(*shape, len(theta))
    rest = np.eye(shape[1]) - np.einsum("nip,pq,njq->nij", J, covariance, J, optimize=True)
    told = np.linalg.eigvalsh(rest)[:, 0] > ALONE
    out = np.full(shape, np.nan)
    residual = problem.residual_of(index, theta).reshape(shape)[told]
    whitened = np.linalg.solve(rest[told], residual[..., None])
    out[told] = np.linalg.solve(block.whitener[told], whitened)[..., 0]
    return out
