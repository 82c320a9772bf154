"""The front door to fitting: `solve` with its methods, losses and named endings. Algorithms are in `solvers/`."""

from calibrate.solvers.dogleg import DogLegRules
from calibrate.solvers.levenberg import FAR_START, NEAR_START
from calibrate.solvers.linear import covariance_of
from calibrate.solvers.loss import Loss, LossKind
from calibrate.solvers.result import Fit, Status, Stop
from calibrate.solvers.solve import Method, solve

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
