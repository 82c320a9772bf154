"""Test functions with known minima and their derivatives, written out.

Numbers and problems: More, Garbow, Hillstrom, ACM Trans. Math. Software 7(1), 1981.
"""

from dataclasses import dataclass, replace

import numpy as np

from calibrate.model.parameters import Parameter


@dataclass(frozen=True)
class Known:
    """Any residual with its derivative."""

    parameters: tuple[Parameter, ...]
    function: object
    slope: object

    def residual(self, theta):
        return np.asarray(self.function(theta), dtype=float)

    def jacobian(self, theta):
        return np.asarray(self.slope(theta), dtype=float)

    def with_parameters(self, parameters):
        return replace(self, parameters=parameters)


def unknowns(*starts, **more):
    return tuple(Parameter(f"p{i}", "1", 1.0, start=s, **more) for i, s in enumerate(starts))


def rosenbrock(**more):
    """Problem 1: minimum 0 at (1, 1)."""
    return Known(
        unknowns(-1.2, 1.0, **more),
        lambda t: [10.0 * (t[1] - t[0] ** 2), 1.0 - t[0]],
        lambda t: [[-20.0 * t[0], 10.0], [-1.0, 0.0]],
    )


def powell_singular():
    """Problem 13: minimum 0 at the origin, where the Jacobian has rank 2."""
    return Known(
        unknowns(3.0, -1.0, 0.0, 1.0),
        lambda t: [
            t[0] + 10 * t[1],
            5**0.5 * (t[2] - t[3]),
            (t[1] - 2 * t[2]) ** 2,
            10**0.5 * (t[0] - t[3]) ** 2,
        ],
        lambda t: [
            [1, 10, 0, 0],
            [0, 0, 5**0.5, -(5**0.5)],
            [0, 2 * (t[1] - 2 * t[2]), -4 * (t[1] - 2 * t[2]), 0],
            [2 * 10**0.5 * (t[0] - t[3]), 0, 0, -2 * 10**0.5 * (t[0] - t[3])],
        ],
    )


def bent_valley(stiff=1e3, reach=0.3):
    """No problem of the paper: a circle that holds `stiff` times more than what pulls along it; minimum 0 at p0 = 0."""
    from_centre = np.hypot(reach, 1.0)
    return Known(
        unknowns(reach, 1.0),
        lambda t: [stiff * (np.hypot(t[0], t[1]) - from_centre), t[0]],
        lambda t: [[stiff * t[0] / np.hypot(t[0], t[1]), stiff * t[1] / np.hypot(t[0], t[1])], [1.0, 0.0]],
    )
