"""The seam of everything that turns joint readings into expected observations; Chain and PairChain are such."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.parameters import Parameter
from calibrate.sensors.model import About, Used

Floats = NDArray[np.float64]


class ObservationModel(Protocol):
    """k observations a row, from the joint readings that the row needs: those of one pose, or of two side by side."""

    @property
    def model(self) -> KinematicModel: ...

    @property
    def sensor(self) -> Used:
        """How the instrument was used at the rows."""
        ...

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

    def placed(self, about: About) -> Self:
        """The same with frames and points where a model's corrections start from."""
        ...

    def facing(self, expected: Floats) -> Self:
        """The same where what was observed is what is expected (row, k)."""
        ...

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        """(row, k) observations for the sensor's own values and the flange (row, 4, 4) of each pose of a row."""
        ...

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        """(row, k, 6) derivative by a base-frame twist [v; w] of the flange, of each pose of a row."""
        ...

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        """(row, k, own) derivative by the sensor's own parameters."""
        ...
