"""Losses: what a whitened observation costs by its length, and with which weight it then counts.

Sources: Huber, Robust Statistics, 1981, ch. 3-4; Holland, Welsch, Comm. Statist. A6(9), 1977 (tuning for 95 %
efficiency at the normal law: 1.345 and 2.385); Lange, Little, Taylor, JASA 84, 1989 (Student's t by reweighting).
A loss is scaled to be z^2 for small z, so that its sum compares with chi2. An observation of k values bends where as
many of good ones lie beyond as of single values beyond the width (the same quantile of chi-square, Maronna, Ann.
Statist. 4(1), 1976); Student's t is the multivariate one, weight (nu + k) / (nu + z^2).
"""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, chdtri

Floats = NDArray[np.float64]
Widths = NDArray[np.intp]

SINGLE = np.ones(1, dtype=np.intp)


class LossKind(Enum):
    """The law of the residuals that a loss answers to."""

    SQUARE = "normal law"
    HUBER = "normal in the middle, with heavy tails that still pull a little"
    CAUCHY = "Cauchy-like: a far row is let go"
    STUDENT_T = "Student's t"


@dataclass(frozen=True)
class Loss:
    """A kind with its width: sigmas where it bends (Huber, Cauchy) or degrees of freedom nu (Student's t)."""

    kind: LossKind
    width: float

    SQUARE: ClassVar["Loss"]
    HUBER: ClassVar["Loss"]
    CAUCHY: ClassVar["Loss"]
    STUDENT_T: ClassVar["Loss"]

    def __post_init__(self) -> None:
        if not self.width > 0.0:
            raise ValueError(f"{self.kind.name} loss: width {self.width} is not positive")

    @classmethod
    def student_t(cls, nu: float) -> "Loss":
        """Student's t with nu degrees of freedom; small nu forgives more."""
        return cls(LossKind.STUDENT_T, nu)

    @property
    def convex(self) -> bool:
        """One minimum for a linear problem; the others need a start near their best one."""
        return self.kind in (LossKind.SQUARE, LossKind.HUBER)

    def bend(self, k: Widths) -> Floats:
        """(obs,) length at which the loss of an observation of k (obs,) values bends; the width itself for Student's t.

        The far quantile is taken from its complement, which keeps digits for wide losses.
        """
        if self.kind in (LossKind.SQUARE, LossKind.STUDENT_T):
            return np.full(len(k), self.width)
        widths, which = np.unique(k, return_inverse=True)
        beyond = chdtrc(1, self.width**2)
        return np.array([self.width if w == 1 else np.sqrt(chdtri(w, beyond)) for w in widths.tolist()])[which]

    def cost(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) what observations of length z (obs,) over k values (obs,), or all one, cost."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return np.where(np.abs(z) <= c, square, 2.0 * c * np.abs(z) - c**2)
        if self.kind is LossKind.CAUCHY:
            return c**2 * np.log1p(square / c**2)
        return (c + k) * np.log1p(square / c) if self.kind is LossKind.STUDENT_T else square

    def weight(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) cost'(z) / (2 z): the weight with which squares have the same slope."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return c / np.maximum(np.abs(z), c)
        if self.kind is LossKind.CAUCHY:
            return 1.0 / (1.0 + square / c**2)
        return (c + k) / (c + square) if self.kind is LossKind.STUDENT_T else np.ones_like(z)

    def curvature(self, z: Floats, k: Widths = SINGLE) -> Floats:
        """(obs,) cost''(z) / 2 along the observation's own direction; negative where the loss bends back."""
        c, square = self.bend(k), z**2
        if self.kind is LossKind.HUBER:
            return (np.abs(z) <= c).astype(float)
        if self.kind is LossKind.CAUCHY:
            return (1.0 - square / c**2) / (1.0 + square / c**2) ** 2
        return (c + k) * (c - square) / (c + square) ** 2 if self.kind is LossKind.STUDENT_T else np.ones_like(z)


Loss.SQUARE = Loss(LossKind.SQUARE, 1.0)
Loss.HUBER = Loss(LossKind.HUBER, 1.345)
Loss.CAUCHY = Loss(LossKind.CAUCHY, 2.385)
Loss.STUDENT_T = Loss.student_t(4.0)  # Lange et al.: 4 served well where nu was not estimated
