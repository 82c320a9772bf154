"""Normal equations in columns of plausible size, with priors: what a solver needs where rows are never held."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from calibrate.parameters import Parameter

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

PANEL = 8  # columns that a QR takes at a time: measured best of 4, 8, 12, 16 and all


@dataclass(frozen=True)
class Normal:
    """At one point; priors are in."""

    matrix: Floats  # (free, free)
    gradient: Floats  # (free,)
    chi2: float

    @cached_property
    def finite(self) -> bool:
        return bool(np.isfinite(self.chi2) and np.all(np.isfinite(self.matrix)))


@dataclass(frozen=True)
class Scaled:
    """The free parameters, their plausible sizes and priors."""

    parameters: tuple[Parameter, ...]
    free: Indices  # columns of theta
    scale: Floats  # (free,)
    centre: Floats  # (free,) start values, which priors pull to
    information: Floats  # (free,) of the priors in scaled columns, 0 where there is none

    @classmethod
    def of(cls, parameters: tuple[Parameter, ...]) -> Self:
        free = np.array([i for i, p in enumerate(parameters) if p.free], dtype=np.intp)
        stated = np.array([(p.plausible, p.start, p.prior) for p in parameters if p.free]).reshape(-1, 3)
        scale, centre, prior = np.ascontiguousarray(stated.T)
        return cls(parameters, free, scale, centre, (scale / prior) ** 2)

    @cached_property
    def believed(self) -> int:
        """Parameters with a prior, each of which is a row."""
        return int(np.count_nonzero(self.information))

    def normal(self, theta: Floats, squared: Floats) -> Normal:
        """`squared` (free + 1, free + 1) is [J r]'[J r] of the data at theta (param,), columns not scaled."""
        matrix, gradient = squared[:-1, :-1] * self._scales, squared[:-1, -1] * self.scale
        if not self.believed:
            return Normal(matrix, gradient, float(squared[-1, -1]))
        deviation = (theta[self.free] - self.centre) / self.scale
        pull = self.information * deviation
        matrix.flat[:: len(matrix) + 1] += self.information
        return Normal(matrix, gradient + pull, float(squared[-1, -1] + pull @ deviation))

    def with_priors(self, J: Floats) -> Floats:
        """(row + free, free) data rows (row, free), not scaled, as scaled ones with the priors' rows below."""
        return np.concatenate([J * self.scale, np.diag(np.sqrt(self.information))])

    def in_full(self, scaled: Floats | None) -> Floats:
        """(param, param) covariance from that of the scaled free parameters: zero for held ones, nan for None."""
        n = len(self.parameters)
        out = np.full((n, n), np.nan if scaled is None else 0.0)
        if scaled is not None:
            out[self.free[:, None], self.free] = scaled * self._scales
        return out

    @cached_property
    def _scales(self) -> Floats:
        return self.scale[:, None] * self.scale


class NormalRows(Protocol):
    """Data that can be asked for their normal equations anywhere."""

    @property
    def scaled(self) -> Scaled: ...

    @property
    def residuals(self) -> int:
        """Data rows."""
        ...

    def normal(self, theta: Floats) -> Normal:
        """At theta (param,), in scaled columns with priors."""
        ...

    def triangle(self, theta: Floats) -> Floats:
        """(row, param + 1) R of the QR of [J r] without priors and scale; columns of held parameters are zero."""
        ...


def upper(rows: Floats) -> Floats:
    """R of the QR of (row, column) by LAPACK itself: numpy's would copy what lies column by column. Rows are lost.

    By panels and recursively, a third faster for tall rows: Elmroth, Gustavson, IBM J. Res. Dev. 44(4), 2000.
    """
    geqrt = lapack.dgeqrt  # pyright: ignore[reportAttributeAccessIssue] - made by f2py, not in the stubs
    raw = geqrt(min(PANEL, *rows.shape), rows, overwrite_a=True)[0]
    return np.triu(raw[: rows.shape[1]])
