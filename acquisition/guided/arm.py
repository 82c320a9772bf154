"""What guidance needs to know of the arm, as believed; given in from outside, since kinematics is not acquisition's."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class GuidedArm(Protocol):
    """A measuring arm as believed."""

    @property
    def lower_rad(self) -> Floats:
        """(n,) smallest readings."""
        ...

    @property
    def upper_rad(self) -> Floats: ...

    def tip_m(self, q_rad: Floats) -> Floats:
        """(row, 3) middle of the probe's ball in the base, for readings (row, n)."""
        ...

    def postures(self, start_rad: Floats, point_m: Floats) -> Floats:
        """Of starts (row, n) those brought to the point (3,) within the joints' ranges, (some, n)."""
        ...
