"""What comes out of a solver: values, covariance, and in named words how it ended."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from calibrate.model.parameters import Parameter

Floats = NDArray[np.float64]


class Status(Enum):
    """How a fit ended; the value is the sentence for a person."""

    CONVERGED = "predicted gain is below tolerance"
    OUT_OF_STEPS = "step limit reached; improve the start, or raise kmax of [dog-leg] in the fit plan"
    STALLED = (
        "no step makes the residual smaller, although the slope promises it; check derivatives, the start, e1 and e2"
    )
    RANK_DEFICIENT = "data cannot fix some combinations of parameters; they are held and named"
    AT_BOUND = "a parameter is at its bound: the question is not answered by these data"
    NOT_FINITE = "residual became infinite or undefined; check joint signs, the order of reflection and the rig"


class Stop(Enum):
    """The rule that ended the iteration; the value is the sentence for a person."""

    GAIN = "a full step promises less than the tolerance"
    ROUNDING = "neither a step nor its promise is above the rounding error of the sum of squares"
    DAMPING = "damping reached its limit: the residual is at its rounding error"
    GRADIENT = "largest element of the gradient is at most e1"
    RESIDUAL = "2-norm of the residual is at most e3"
    RADIUS = "trust radius shrank to e2 of the parameters"
    STEP = "step is no longer than e2 of the parameters"
    STEPS = "all allowed steps (kmax of Dog-Leg) were made"
    LIKELIHOOD = "a further round of weights changes -2 log L by less than 0.1"
    ROUNDS = "all allowed rounds of weights were made"
    NOT_FINITE = "residual or derivative is not finite"


@dataclass(frozen=True)
class Fit:
    """Values at the end, with their covariance where the free columns are of full rank."""

    theta: Floats  # (param,)
    parameters: tuple[Parameter, ...]
    covariance: Floats  # (param, param), zero for held ones, nan where it does not exist
    status: Status
    chi2: float  # sum of squares of data and prior rows, whatever the loss
    dof: int  # data and prior rows less free parameters
    steps: int
    at_bound: tuple[str, ...] = ()
    stop: Stop = Stop.GAIN
    cost: float = float("nan")  # what was made small: chi2 for squares, sum of the loss otherwise
    weights: Floats | None = None  # (row,) of the data rows under a robust loss, 1 = fully trusted; None: all 1

    @property
    def chi2_per_dof(self) -> float:
        """Near 1 when the model and the stated noise agree; nan without redundancy."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")
