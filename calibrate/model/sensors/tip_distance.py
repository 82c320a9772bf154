"""Instruments that compare two poses: the distance between the target at both, which needs no frame (bar, distance).

Source of the relative distance |P_n - P_(n-1)| as an observation: patent CN114523474B, step 4.
"""

from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from calibrate.model.chain import About, ObservationModel, Usage, Used
from calibrate.model.parameters import Parameter
from calibrate.model.placement import Target, point_by_twist

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


@dataclass(frozen=True)
class TipDistance(Usage):
    """Observed of a pair: |tip_b - tip_a| (m). Parameters: target 3."""

    target: Target

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters

    def about(self) -> About:
        return self.target.about()

    def placed(self, about: About) -> Self:
        return replace(self, target=self.target.placed(about))

    def select(self, rows: NDArray[np.intp]) -> Self:
        return self

    def expect(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        return np.linalg.norm(self._span(phi, T_base_a, T_base_b), axis=1, keepdims=True)

    def by_twists(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> tuple[Floats, Floats]:
        along = self._along(phi, T_base_a, T_base_b)
        by_a = -along @ point_by_twist(self.target.in_base(phi, T_base_a))
        return by_a, along @ point_by_twist(self.target.in_base(phi, T_base_b))

    def by_parameter(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        return self._along(phi, T_base_a, T_base_b) @ (T_base_b[:, :3, :3] - T_base_a[:, :3, :3])

    def _span(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        return self.target.in_base(phi, T_base_b) - self.target.in_base(phi, T_base_a)

    def _along(self, phi: Floats, T_base_a: Floats, T_base_b: Floats) -> Floats:
        """(pair, 1, 3) unit vector from a to b; nan where both are one point, which `pairs` never chooses."""
        span = self._span(phi, T_base_a, T_base_b)
        return (span / np.linalg.norm(span, axis=1, keepdims=True))[:, None]
