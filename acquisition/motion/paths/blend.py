"""The transition about a corner: it takes position, speed and acceleration of the segment before over into the next.

Between two straight segments through one corner it is the quartic of the source,
q = [(dC tacc/T + dB)(2 - h) h^2 - 2 dB] h + B + dB (R. Paul, Robot Manipulators, 1981, ch. 5.6): six conditions fix a
fifth degree, whose last coefficient is then zero. Curved segments (joint to straight line, a belt, two turns at once)
meet without a jump, too, which the quartic alone does not give. docs/decisions/0012.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Fifth degree in h = 0..1 by value, slope and curvature at both ends: rows h^0 ... h^5.
_HERMITE = np.linalg.inv(
    np.array(
        [
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 2.0, 0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            [0.0, 0.0, 2.0, 6.0, 12.0, 20.0],
        ]
    )
)
PROBE_S = 5e-3  # between the samples that slopes are read off: error of fourth order, rounding 1e-13 / PROBE_S^2


@dataclass(frozen=True, eq=False)
class BlendState:
    """Position, speed and acceleration (n,) at one moment, in whatever coordinates the blend is made in."""

    position: Floats
    speed: Floats
    acceleration: Floats


@dataclass(frozen=True, eq=False)
class Blend:
    """From `begin_s` to `end_s`."""

    begin_s: float
    end_s: float
    coefficients: Floats  # (6, n) of powers of h

    def at(self, t_s: float) -> Floats:
        """(n,) h runs from 0 to 1."""
        h = (t_s - self.begin_s) / (self.end_s - self.begin_s)
        return np.power(h, np.arange(6)) @ self.coefficients


def blend(begin_s: float, begin: BlendState, end_s: float, end: BlendState) -> Blend:
    """The blend that meets both states."""
    span = end_s - begin_s
    rows = [begin.position, begin.speed * span, begin.acceleration * span**2]
    rows += [end.position, end.speed * span, end.acceleration * span**2]
    return Blend(begin_s, end_s, _HERMITE @ np.stack(rows))


def state_of(curve: Callable[[float], Floats], t_s: float) -> BlendState:
    """Position, speed and acceleration of a smooth curve, by differences of fourth order."""
    a, b, c, d, e = (curve(t_s + k * PROBE_S) for k in (-2, -1, 0, 1, 2))
    speed = (a - 8.0 * b + 8.0 * d - e) / (12.0 * PROBE_S)
    acceleration = (-a + 16.0 * b - 30.0 * c + 16.0 * d - e) / (12.0 * PROBE_S**2)
    return BlendState(c, speed, acceleration)
