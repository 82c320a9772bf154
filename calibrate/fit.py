"""The front door to fitting: `solve` with its methods, losses and named endings. Algorithms are in `solvers/`.

A problem of tracked positions and nothing else goes through compiled normal equations, to the same answer.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.kernels.position_fit import fit_positions, positions_of
from calibrate.problem import LeastSquares
from calibrate.solvers import solve as by_rows
from calibrate.solvers.dogleg import DogLegRules
from calibrate.solvers.levenberg import FAR_START, NEAR_START
from calibrate.solvers.linear import covariance_of
from calibrate.solvers.loss import Loss, LossKind
from calibrate.solvers.result import Fit, Status, Stop
from calibrate.solvers.solve import Method

__all__ = [
    "FAR_START",
    "NEAR_START",
    "DogLegRules",
    "Fit",
    "Loss",
    "LossKind",
    "Method",
    "Status",
    "Stop",
    "covariance_of",
    "solve",
]

Floats = NDArray[np.float64]


def solve(
    problem: LeastSquares,
    *,
    method: Method = Method.LEVENBERG,
    loss: Loss = Loss.SQUARE,
    start: Floats | None = None,
    damping: float = FAR_START,
    rules: DogLegRules | None = None,
    max_steps: int = 100,
    tolerance: float = 1e-8,
) -> Fit:
    """Least squares, or least loss, from `start` (param,), nominal if None; all arguments as in solvers/solve.py."""
    if method is Method.LEVENBERG and loss.kind is LossKind.SQUARE:
        positions = positions_of(problem)
        if positions is not None:
            return fit_positions(positions, start=start, damping=damping, max_steps=max_steps, tolerance=tolerance)
    return by_rows.solve(
        problem,
        method=method,
        loss=loss,
        start=start,
        damping=damping,
        rules=rules,
        max_steps=max_steps,
        tolerance=tolerance,
    )
