"""How every fit of one identification is solved: the same method and loss for the answer and for its proofs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.fit import NEAR_START, Fit, Loss, Method, solve
from calibrate.problem import LeastSquares

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Estimator:
    """A method with a loss."""

    method: Method = Method.LEVENBERG
    loss: Loss = Loss.SQUARE

    def fit(self, problem: LeastSquares, start: Floats, damping: float = NEAR_START) -> Fit:
        """From `start` (param,), by default one known to be good."""
        return solve(problem, method=self.method, loss=self.loss, start=start, damping=damping)


LEAST_SQUARES = Estimator()
