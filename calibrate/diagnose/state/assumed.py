"""What a model states of a later recording: its values and their covariance, and effects that it brings along."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Samples
from calibrate.diagnose import limits
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.term import Size, Term

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

# Of the largest variance, in plausible sizes: below, a file of double precision cannot separate it from rounding. It is
# then taken as larger than it is.
ROUNDING = 1e-14
RANK = 1e-10  # of the largest singular value of scaled columns


@dataclass(frozen=True, eq=False)
class Assumed:
    """A normal prior over some values of a fit; other parts of the covariance of the model are averaged out."""

    at: Ints  # (k,) index of each value in the fit
    mean: Floats  # (k,)
    root: Floats  # (row, k) root' root is the inverse covariance
    of_difference: bool = False  # what is sought beside it is of either sign: of two recordings either may have more

    @classmethod
    def of(cls, at: Ints, mean: Floats, covariance: Floats, plausible: Floats) -> "Assumed":
        """`covariance` (k, k), `plausible` (k,) sizes by which it is scaled."""
        w, V = np.linalg.eigh(covariance / np.outer(plausible, plausible))
        w = np.maximum(w, ROUNDING * max(float(w.max(initial=0.0)), 1e-300))
        return cls(at, mean, (V / np.sqrt(w)).T / plausible)

    def held_near(self, slope: Floats, others: Ints, unit: Floats) -> "Assumed":
        """The same, with the mean held to one `unit` (k,) along directions that it knows worse and the data not at all.

        `slope` (row, value) of the whitened data, `others` the values that it shows nothing of. What trades a tool for
        the last link is unknown by decimetres, and a covariance is right to first order only: some millimetres that
        way, for nothing, would hide a tool that has moved by a tenth of one.
        """
        free = slope[:, others]
        size = np.linalg.norm(free, axis=0)
        U, s, _ = np.linalg.svd(free[:, size > 0.0] / size[size > 0.0], full_matrices=False)
        Q = U[:, s > RANK * s.max(initial=0.0)]
        seen = slope[:, self.at] * unit
        seen = seen - Q @ (Q.T @ seen)
        _, known, Vt = np.linalg.svd(np.concatenate([self.root * unit, seen]), full_matrices=False)
        weak = Vt[known < 1.0]
        if len(weak) == 0:
            return self
        _, known, Vt = np.linalg.svd(
            np.concatenate([seen @ weak.T, np.zeros((len(weak), len(weak)))]), full_matrices=False
        )
        return replace(self, root=np.concatenate([self.root, Vt[known < limits.UNSEEN_ASSUMED] @ weak / unit]))

    def residual(self, values: Floats) -> Floats:
        """(row,)"""
        return np.asarray(self.root @ (values[self.at] - self.mean))

    def jacobian(self, count: int) -> Floats:
        """(row, count)"""
        out = np.zeros((len(self.root), count))
        out[:, self.at] = self.root
        return out


@dataclass(frozen=True)
class Stated(Term):
    """An effect as a model states it, at the rows of one recording: its values keep the meaning of the model's file."""

    columns: Floats = field(kw_only=True)  # (row, width, value)
    added: Floats = field(kw_only=True)  # (row, width) at the values `about`
    about: Floats = field(kw_only=True)  # (value,)
    at_samples: Callable[[Samples], tuple[Floats, Floats]] = field(kw_only=True)  # `columns` and `added` of other rows

    def at(self, samples: Samples) -> "Stated":
        """The same at other rows. DataError where the effect cannot be evaluated there."""
        columns, added = self.at_samples(samples)
        return replace(self, columns=columns, added=added)

    def basis(self, drivers: Drivers, inner: Floats) -> Floats:
        return self.columns

    def amount(self, drivers: Drivers, coefficients: Floats, inner: Floats) -> Floats:
        return self.added + self.columns @ (coefficients - self.about)

    def sizes(self, coefficients: Floats, covariance: Floats, inner: Floats, inner_sigma: Floats) -> Mapping[str, Size]:
        return {}

    def plausible(self, coefficients: Floats, inner: Floats, noise_rad: float) -> bool:
        return True

    def says(self, sizes: Mapping[str, Size]) -> str:
        return ""
