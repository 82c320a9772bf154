"""The rows of one instrument as the search for bad ones sees them: what was read, what the fitted arm expects."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]
Bools = NDArray[np.bool_]

LIMIT = 10.0  # robust sigmas: the farthest of 6000 rows of four real robots lies at 9, from physics no model had
LEAST_SCALE = 0.1  # of the assumed noise: perfect data make no row suspicious


@dataclass(frozen=True)
class Shots:
    """Observations (obs, k) with their columns; `expect` predicts them for other joint angles at the same shots."""

    rows: Rows  # (obs,) in the samples, from 0
    columns: tuple[str, ...]  # (k,)
    q_rad: Floats  # (obs, joint)
    observed: Floats  # (obs, k)
    sigma: Floats  # (k,) assumed, in the unit of the columns
    expect: Callable[[Rows, Floats], Floats]  # which of the obs, their angles (m, joint) -> (m, k)
    posture: Floats | None = None  # (obs, n) between which distances are those of postures; None: by the angles
    met: int = 0  # rows that the fit can meet exactly: they show nothing about what distance is usual

    def misfit(self) -> Floats:
        """(obs, k) expected minus observed over assumed sigma."""
        every = np.arange(len(self.rows))
        return (self.expect(every, self.q_rad) - self.observed) / self.sigma


def robust_scale(distance: Floats, k: int, met: int = 0) -> float:
    """One sigma of a coordinate from the median of distances (obs,) over k coordinates (Hampel's MAD, for chi).

    `met`: so many of the nearest rows are not counted.
    """
    middle = float(np.median(np.sort(distance)[met:]))
    return max(middle / float(np.sqrt(chdtri(k, 0.5))), LEAST_SCALE)


def outlying(distance: Floats, k: int, met: int = 0) -> Bools:
    """(obs,) rows whose distance over k coordinates no noise of these data reaches."""
    return distance > LIMIT * robust_scale(distance, k, met)
