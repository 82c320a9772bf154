"""The seam of instruments that compare two poses (a bar, a distance), and the chain of an arm with one."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibrate.model.observation_model import ObservationModel
from calibrate.model.sensor_model import Used

Floats = NDArray[np.float64]


class PairSensor(Used, Protocol):
    """As sensors.model.Sensor, but of two flange poses a row."""

    def expect(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        """(pair, k) readings for flange poses (pair, 4, 4) each and parameter values phi (param,)."""
        ...

    def by_twists(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> tuple[Floats, Floats]:
        """(pair, k, 6) derivative by a base-frame twist [v; w] of flange a, and of flange b."""
        ...

    def by_parameter(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        """(pair, k, param) derivative by the sensor's own parameters."""
        ...


@dataclass(frozen=True)
class PairChain(ObservationModel):
    """ObservationModel of pairs of poses."""

    sensor: PairSensor

    poses = 2

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.expect(own, *flanges)

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        return self.sensor.by_twists(own, *flanges)

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.by_parameter(own, *flanges)
