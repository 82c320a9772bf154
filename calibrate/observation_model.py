"""The seam of everything that turns joint readings into expected observations; Chain and PairChain are such."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.parameters import Parameter

Floats = NDArray[np.float64]


class ObservationModel(Protocol):
    """k observations a row, from the joint readings that the row needs: those of one pose, or of two side by side."""

    @property
    def model(self) -> KinematicModel: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def expect(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k) observations for readings (row, reading)."""
        ...

    def jacobian(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k, param) derivative by every parameter, free or not."""
        ...

    def by_joint(self, theta: Floats, q_rad: Floats) -> Floats:
        """(row, k, reading) derivative by the readings."""
        ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same model at some of the rows."""
        ...
