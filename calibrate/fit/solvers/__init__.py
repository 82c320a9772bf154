"""The front door to fitting: `solve` with its methods, losses and named endings. One file an algorithm."""

from calibrate.fit.solvers.dogleg import DogLegRules
from calibrate.fit.solvers.levenberg import FAR_START, NEAR_START
from calibrate.fit.solvers.linear import covariance_of, triangle_of
from calibrate.fit.solvers.loss import Loss, LossKind
from calibrate.fit.solvers.result import Fit, Status, Stop
from calibrate.fit.solvers.solve import Method, solve

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
    "triangle_of",
]
