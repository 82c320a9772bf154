"""The front door to fitting: `solve` with its methods, losses and named endings. Its algorithms in one room each."""

from calibrate.fit.solvers.least_squares import Fit, Status, Stop, covariance_of, triangle_of
from calibrate.fit.solvers.robust import Loss, LossKind
from calibrate.fit.solvers.solve import Estimator, Method, solve
from calibrate.fit.solvers.trust_region import FAR_START, NEAR_START, DogLegRules

__all__ = [
    "FAR_START",
    "NEAR_START",
    "DogLegRules",
    "Estimator",
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
