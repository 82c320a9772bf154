"""An arm model and an instrument together: joint readings to expected observations."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.parameters import Parameter
from calibrate.sensors.model import About, Sensor

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """Parameters are those of the model, then those of the sensor; any model meets any sensor by one chain rule."""

    model: KinematicModel
    sensor: Sensor

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        return self.model.parameters + self.sensor.parameters

    def expect(self, theta: Floats, q_rad: Floats) -> Floats:
        """(pose, k) observations for joint readings (pose, joint)."""
        of_model, of_sensor = self._split(theta)
        return self.sensor.expect(of_sensor, self.model.flange(of_model, q_rad))

    def jacobian(self, theta: Floats, q_rad: Floats) -> Floats:
        """(pose, k, param) derivative by every parameter, free or not."""
        of_model, of_sensor = self._split(theta)
        T_base_flange = self.model.flange(of_model, q_rad)
        arm = self.sensor.by_twist(of_sensor, T_base_flange) @ self.model.twists(of_model, q_rad)
        return np.concatenate([arm, self.sensor.by_parameter(of_sensor, T_base_flange)], axis=-1)

    def by_joint(self, theta: Floats, q_rad: Floats) -> Floats:
        """(pose, k, joint) derivative by the joint angles."""
        of_model, of_sensor = self._split(theta)
        T_base_flange = self.model.flange(of_model, q_rad)
        return self.sensor.by_twist(of_sensor, T_base_flange) @ self.model.joint_twists(of_model, q_rad)

    def select(self, rows: NDArray[np.intp]) -> "Chain":
        """The same chain at some of the poses."""
        return replace(self, sensor=self.sensor.select(rows))

    def placed(self, about: About) -> "Chain":
        return replace(self, sensor=self.sensor.placed(about))

    def facing(self, expected: Floats) -> "Chain":
        return replace(self, sensor=self.sensor.facing(expected))

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.expect(own, flanges[0])

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        return (self.sensor.by_twist(own, flanges[0]),)

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        return self.sensor.by_parameter(own, flanges[0])

    def _split(self, theta: Floats) -> tuple[Floats, Floats]:
        n = len(self.model.parameters)
        return theta[:n], theta[n:]
