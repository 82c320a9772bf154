"""Losses: what a whitened residual costs, and with which weight its row then counts.

Sources: Huber, Robust Statistics, 1981, ch. 3-4; Holland, Welsch, Comm. Statist. A6(9), 1977 (tuning for 95 %
efficiency at the normal law: 1.345 and 2.385); Lange, Little, Taylor, JASA 84, 1989 (Student's t by reweighting).
A loss is scaled to be z^2 for small z, so that its sum compares with chi2.
"""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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

    def cost(self, z: Floats) -> Floats:
        """(row,) what each whitened residual costs."""
        c, square = self.width, z**2
        if self.kind is LossKind.HUBER:
            return np.where(np.abs(z) <= c, square, 2.0 * c * np.abs(z) - c**2)
        if self.kind is LossKind.CAUCHY:
            return c**2 * np.log1p(square / c**2)
        return (c + 1.0) * np.log1p(square / c) if self.kind is LossKind.STUDENT_T else square

    def weight(self, z: Floats) -> Floats:
        """(row,) cost'(z) / (2 z): the weight with which squares have the same slope."""
        c, square = self.width, z**2
        if self.kind is LossKind.HUBER:
            return c / np.maximum(np.abs(z), c)
        if self.kind is LossKind.CAUCHY:
            return 1.0 / (1.0 + square / c**2)
        return (c + 1.0) / (c + square) if self.kind is LossKind.STUDENT_T else np.ones_like(z)

    def curvature(self, z: Floats) -> Floats:
        """(row,) cost''(z) / 2; negative where the loss bends back."""
        c, square = self.width, z**2
        if self.kind is LossKind.HUBER:
            return (np.abs(z) <= c).astype(float)
        if self.kind is LossKind.CAUCHY:
            return (1.0 - square / c**2) / (1.0 + square / c**2) ** 2
        return (c + 1.0) * (c - square) / (c + square) ** 2 if self.kind is LossKind.STUDENT_T else np.ones_like(z)


Loss.SQUARE = Loss(LossKind.SQUARE, 1.0)
Loss.HUBER = Loss(LossKind.HUBER, 1.345)
Loss.CAUCHY = Loss(LossKind.CAUCHY, 2.385)
Loss.STUDENT_T = Loss.student_t(4.0)  # Lange et al.: 4 served well where nu was not estimated
