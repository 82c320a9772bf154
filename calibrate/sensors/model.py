"""The seam of instruments: flange poses to what the instrument would say, with analytic derivatives."""

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter

Floats = NDArray[np.float64]


class Sensor(Protocol):
    """An instrument together with how it was used at each pose of a data set (place, order, seat, ...).

    A new instrument is one file. Values are observed in `unit`; k of them at a pose.
    """

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def unit(self) -> str: ...

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k) readings for flange poses (pose, 4, 4) and parameter values phi (param,)."""
        ...

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k, 6) derivative by a base-frame twist [v; w] of the flange."""
        ...

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, k, param) derivative by the sensor's own parameters."""
        ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same instrument at some of the poses."""
        ...
