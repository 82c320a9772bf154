"""The rows that every solver sees: weighted data and priors of the free parameters, in columns of plausible size.

With columns scaled so, a step of 1 is a deviation to be expected, and one trust radius or damping serves lengths and
angles alike. Bounds: a step is clipped to them, and a parameter at its bound whose gradient pushes outwards is left
out of the step (projected Newton, Bertsekas, SIAM J. Control Optim. 20(2), 1982).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.solvers.result import Stop
from calibrate.model.parameters import plausible_sizes, priors, start_values
from calibrate.model.problem import LeastSquares

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """LeastSquares with its priors as rows; parameters enter by their free ones only, in units of `scale`."""

    problem: LeastSquares
    free: NDArray[np.intp]  # columns of theta
    scale: Floats  # (free,) plausible sizes
    centre: Floats  # (prior,) where priors pull to
    prior: Floats  # (prior,) their sigmas
    believed: NDArray[np.intp]  # among the free ones
    lower: Floats  # (free,)
    upper: Floats
    root_weight: Floats | None = None  # (row,) on the data rows; None: all 1

    @classmethod
    def of(cls, problem: LeastSquares) -> "Rows":
        parameters = problem.parameters
        free = np.flatnonzero([p.free for p in parameters])
        prior, centre = priors(parameters)[free], start_values(parameters)[free]
        believed = np.flatnonzero(np.isfinite(prior))
        return cls(
            problem,
            free,
            plausible_sizes(parameters)[free],
            centre[believed],
            prior[believed],
            believed,
            np.array([p.lower for p in parameters])[free],
            np.array([p.upper for p in parameters])[free],
        )

    def weighted(self, weights: Floats) -> "Rows":
        """The same with weights (row,) on the squares of the data rows."""
        return replace(self, root_weight=np.sqrt(weights))

    def residual(self, theta: Floats) -> Floats:
        """(row + prior,) data rows, then prior rows."""
        data = self.problem.residual(theta)
        if self.root_weight is not None:
            data = self.root_weight * data
        return np.concatenate([data, (theta[self.free][self.believed] - self.centre) / self.prior])

    def jacobian(self, theta: Floats) -> Floats:
        """(row + prior, free) by the scaled free parameters."""
        data = self.problem.jacobian(theta)
        out = np.zeros((len(data) + len(self.believed), len(self.free)))
        rows, beliefs = out[: len(data)], out[len(data) :]
        np.take(data, self.free, axis=1, out=rows, mode="clip")
        rows *= self.scale
        if self.root_weight is not None:
            rows *= self.root_weight[:, None]
        beliefs[range(len(self.believed)), self.believed] = self.scale[self.believed] / self.prior
        return out

    def scaled(self, theta: Floats) -> Floats:
        """(free,) values in units of plausible size."""
        return theta[self.free] / self.scale

    def moved(self, theta: Floats, step: Floats) -> Floats:
        """Theta after a scaled step (free,), clipped to the bounds."""
        out = theta.copy()
        out[self.free] = np.clip(theta[self.free] + step * self.scale, self.lower, self.upper)
        return out

    def taken(self, theta: Floats, trial: Floats) -> Floats:
        """(free,) the scaled step between two theta."""
        return (trial - theta)[self.free] / self.scale

    def pressed(self, theta: Floats, gradient: Floats) -> Bools:
        """(free,) at a bound with descent pointing out of it."""
        value = theta[self.free]
        return ((value <= self.lower) & (gradient > 0.0)) | ((value >= self.upper) & (gradient < 0.0))

    def at_bound(self, theta: Floats) -> Bools:
        """(free,) at a bound, whatever the gradient."""
        value = theta[self.free]
        return (value <= self.lower) | (value >= self.upper)


@dataclass(frozen=True)
class Ended:
    """Where an algorithm came to rest; residual and slope are those of `Rows` at `theta`."""

    theta: Floats
    residual: Floats
    slope: Floats | None  # None where the residual is not finite
    stop: Stop
    steps: int


def columns(slope: Floats, active: Bools) -> Floats:
    """(row, active) those columns; the same array where all are, so that J'J costs half (one buffer, one triangle)."""
    return slope if active.all() else slope[:, active]


def gain_ratio(old: Floats, new: Floats, change: Floats) -> float:
    """Actual over predicted decrease of the sum of squares for a linear change (row,); -1 where `new` is not finite."""
    if not np.all(np.isfinite(new)):
        return -1.0
    linear = old + change
    predicted = float((old - linear) @ (old + linear))
    actual = float((old - new) @ (old + new))
    return actual / predicted if predicted > 0.0 else -1.0
