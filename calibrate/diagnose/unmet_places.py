"""Where something stood that a fit has not met: a place left out is found from its own readings before it is judged."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibrate.diagnose.augmented import Augmented
from calibrate.diagnose.noise_of_fit import covariance_at
from calibrate.diagnose.scatter import Scatter
from calibrate.fit import NEAR_START, solve
from calibrate.parameters import Parameter
from calibrate.problem import whitener_of
from calibrate.sensors import point_line, seat

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

PLACES = ("placement", seat.POINTS, point_line.POINTS)  # of where something stood; a place may be met unseen


def places_found(
    problem: Augmented, values: Floats, scatters: tuple[Scatter, ...], rows: tuple[Ints, ...], data_rows: int
) -> Floats:
    """Values in which places that the fit has not met are found from these rows of each instrument, all else held.

    `data_rows`: of the problem's own rows, those of readings.
    """
    parameters = problem.parameters
    place = np.array([p.free and p.name.startswith(PLACES) for p in parameters])
    met = np.any(problem.jacobian(values)[:data_rows] != 0.0, axis=0)
    unmet = place & ~met
    if not unmet.any():
        return values
    whiteners = tuple(
        whitener_of(covariance_at(s, old, r)) for s, old, r in zip(scatters, problem.rows, rows, strict=True)
    )
    held = tuple(p if u else replace(p, free=False) for p, u in zip(parameters, unmet, strict=True))
    there = _Held(replace(problem, rows=rows, whiteners=whiteners, last={}, slopes={}), held)
    return solve(there, start=values, damping=NEAR_START).theta


@dataclass(frozen=True, eq=False)
class _Held:
    """A problem with other beliefs."""

    problem: Augmented
    parameters: tuple[Parameter, ...]

    def residual(self, theta: Floats) -> Floats:
        return self.problem.residual(theta)

    def jacobian(self, theta: Floats) -> Floats:
        return self.problem.jacobian(theta)
