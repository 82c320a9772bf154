"""An arm and an instrument that reads single poses."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.model.observation_model import ObservationModel
from calibrate.model.sensor_model import Sensor

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Chain(ObservationModel):
    """ObservationModel of single poses."""

    sensor: Sensor

    poses = 1

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.expect(own, *flanges)

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        return (self.sensor.by_twist(own, *flanges),)

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.by_parameter(own, *flanges)
