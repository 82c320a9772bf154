"""Which residual values are of one observation: a bad shot is bad in all its coordinates, so it is weighted as one.

What counts for a loss is then the Mahalanobis norm of an observation's whitened values. Sources: Maronna, Ann. Statist.
4(1), 1976 (weights of the norm); Lange, Little, Taylor, JASA 84, 1989 (the multivariate t).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from calibrate.problem import LeastSquares

Floats = NDArray[np.float64]
Widths = NDArray[np.intp]


@runtime_checkable
class Grouped(Protocol):
    """A problem that says how many residual values each of its observations has."""

    @property
    def row_widths(self) -> Widths:
        """(observation,) values of each, in the order of the residual."""
        ...


@dataclass(frozen=True)
class Groups:
    """Observations of `widths` (observation,) values, one after the other."""

    widths: Widths

    @classmethod
    def of(cls, problem: LeastSquares, rows: int) -> "Groups":
        """As the problem says, else each of its `rows` values for itself."""
        return cls(problem.row_widths if isinstance(problem, Grouped) else np.ones(rows, dtype=np.intp))

    @cached_property
    def _first(self) -> Widths:
        return np.concatenate([[0], np.cumsum(self.widths)[:-1]]).astype(np.intp)

    def norms(self, residual: Floats) -> Floats:
        """(observation,) length of each observation's whitened residual (row,)."""
        filled = self.widths > 0
        out = np.zeros(len(self.widths))
        if filled.any():
            out[filled] = np.sqrt(np.add.reduceat(residual**2, self._first[filled]))
        return out

    def spread(self, values: Floats) -> Floats:
        """(row,) from values (observation,)."""
        return np.repeat(values, self.widths)
