"""How every fit of one identification is solved: the same method and loss for the answer and for its proofs."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers import (
    NEAR_START,
    DogLegRules,
    Fit,
    Loss,
    Method,
    solve,
)
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Estimator:
    """A method with a loss, and with the numbers of Dog-Leg where they are not the usual ones."""

    method: Method = Method.LEVENBERG
    loss: Loss = Loss.SQUARE
    rules: DogLegRules | None = None

    @property
    def with_usual_rules(self) -> "Estimator":
        """For figures beside the answer, which limits set for the answer must not cut short."""
        return replace(self, rules=None)

    def fit(self, problem: LeastSquares, start: Floats, damping: float = NEAR_START) -> Fit:
        """From `start` (param,), by default one known to be good."""
        return solve(problem, method=self.method, loss=self.loss, start=start, damping=damping, rules=self.rules)


LEAST_SQUARES = Estimator()
