"""The seam of instruments that compare two poses (a bar, a distance), and the chain of an arm with one.

Readings of both poses stand side by side, (pair, 2 joint), so that everything that works on a Chain works on pairs.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.model import KinematicModel
from calibrate.parameters import Parameter
from calibrate.sensors.model import About, Used

Floats = NDArray[np.float64]


class PairSensor(Used, Protocol):
    """As sensors.model.Sensor, but of two flange poses a row."""

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def unit(self) -> str: ...

    def expect(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        """(pair, k) readings for flange poses (pair, 4, 4) each and parameter values phi (param,)."""
        ...

    def by_twists(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> tuple[Floats, Floats]:
        """(pair, k, 6) derivative by a base-frame twist [v; w] of flange a, and of flange b."""
        ...

    def by_parameter(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        """(pair, k, param) derivative by the sensor's own parameters."""
        ...

    def select(self, rows: NDArray[np.intp]) -> Self:
        """The same instrument at some of the pairs."""
        ...


@dataclass(frozen=True)
class PairChain:
    """ObservationModel of pairs. Parameters are those of the arm, then those of the sensor."""

    model: KinematicModel
    sensor: PairSensor

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self._parameters

    @cached_property
    def _parameters(self) -> tuple[Parameter, ...]:
        return self.model.parameters + self.sensor.parameters

    def expect(self, theta: Floats, q_rad: Floats) -> Floats:
        of_model, of_sensor = self._split(theta)
        return self.sensor.expect(of_sensor, *self._flanges(of_model, q_rad))

    def jacobian(self, theta: Floats, q_rad: Floats) -> Floats:
        of_model, of_sensor = self._split(theta)
        T_base_a, T_base_b = self._flanges(of_model, q_rad)
        by_a, by_b = self.sensor.by_twists(of_sensor, T_base_a, T_base_b)
        q_a, q_b = self._readings(q_rad)
        arm = by_a @ self.model.twists(of_model, q_a) + by_b @ self.model.twists(of_model, q_b)
        return np.concatenate([arm, self.sensor.by_parameter(of_sensor, T_base_a, T_base_b)], axis=-1)

    def by_joint(self, theta: Floats, q_rad: Floats) -> Floats:
        of_model, of_sensor = self._split(theta)
        by_a, by_b = self.sensor.by_twists(of_sensor, *self._flanges(of_model, q_rad))
        q_a, q_b = self._readings(q_rad)
        return np.concatenate(
            [by_a @ self.model.joint_twists(of_model, q_a), by_b @ self.model.joint_twists(of_model, q_b)], axis=-1
        )

    def select(self, rows: NDArray[np.intp]) -> "PairChain":
        return replace(self, sensor=self.sensor.select(rows))

    def placed(self, about: About) -> "PairChain":
        return replace(self, sensor=self.sensor.placed(about))

    def facing(self, expected: Floats) -> "PairChain":
        return replace(self, sensor=self.sensor.facing(expected))

    def at_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        a, b = flanges
        return self.sensor.expect(own, a, b)

    def by_flanges(self, own: Floats, flanges: tuple[Floats, ...]) -> tuple[Floats, ...]:
        a, b = flanges
        return self.sensor.by_twists(own, a, b)

    def by_own(self, own: Floats, flanges: tuple[Floats, ...]) -> Floats:
        a, b = flanges
        return self.sensor.by_parameter(own, a, b)

    def _split(self, theta: Floats) -> tuple[Floats, Floats]:
        n = len(self.model.parameters)
        return theta[:n], theta[n:]

    def _readings(self, q_rad: Floats) -> tuple[Floats, Floats]:
        return q_rad[:, : self.model.n_joints], q_rad[:, self.model.n_joints :]

    def _flanges(self, theta: Floats, q_rad: Floats) -> tuple[Floats, Floats]:
        q_a, q_b = self._readings(q_rad)
        return self.model.flange(theta, q_a), self.model.flange(theta, q_b)
