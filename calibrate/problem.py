"""A weighted least-squares problem: residuals whitened so that noise is one, and their derivative."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.chain import Chain
from calibrate.parameters import Parameter

Floats = NDArray[np.float64]


class LeastSquares(Protocol):
    """What a solver and the identifiability analysis see. Priors and bounds are in `parameters`, not in the rows."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def residual(self, theta: Floats) -> Floats:
        """(row,) whitened, expected minus observed."""
        ...

    def jacobian(self, theta: Floats) -> Floats:
        """(row, param) derivative of `residual` by every parameter, free or not."""
        ...


@dataclass(frozen=True)
class Problem:
    """Chain against data. `parameters` may hold or bound what the chain leaves free."""

    chain: Chain
    parameters: tuple[Parameter, ...]
    q_rad: Floats  # (pose, joint)
    observed: Floats  # (pose, k)
    whitener: Floats  # (pose, k, k) W with W cov W' = 1

    def residual(self, theta: Floats) -> Floats:
        return np.einsum("nij,nj->ni", self.whitener, self.misfit(theta)).ravel()

    def jacobian(self, theta: Floats) -> Floats:
        return (self.whitener @ self.chain.jacobian(theta, self.q_rad)).reshape(-1, len(self.parameters))

    def misfit(self, theta: Floats) -> Floats:
        """(pose, k) expected minus observed, in the sensor's unit."""
        return self.chain.expect(theta, self.q_rad) - self.observed

    def with_parameters(self, parameters: tuple[Parameter, ...]) -> "Problem":
        return replace(self, parameters=parameters)

    def with_covariance(self, covariance: Floats) -> "Problem":
        """Weights from the covariance (pose, k, k) of the noise."""
        return replace(self, whitener=whitener_of(covariance))

    def select(self, rows: NDArray[np.intp]) -> "Problem":
        """The same problem over some of the poses."""
        return Problem(
            self.chain.select(rows), self.parameters, self.q_rad[rows], self.observed[rows], self.whitener[rows]
        )


def whitener_of(covariance: Floats) -> Floats:
    """(..., k, k) inverse of the lower Cholesky factor of a covariance."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), dtype=np.float64)
