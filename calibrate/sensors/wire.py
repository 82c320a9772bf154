"""Instrument: a draw wire (or a ball bar with its seat as origin) that measures the distance to the target."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter
from calibrate.sensors.device import Device
from calibrate.sensors.target import Target, point_by_twist

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Wire:
    """Observed at a pose: distance (m) from the device's origin to the target. Parameters: target 3, origin 3.

    A length knows nothing of the device's axes, so only the origin of `device` counts.
    """

    target: Target
    device: Device

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.device.origin_parameters

    def select(self, rows: NDArray[np.intp]) -> Self:
        return self

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        span = self._span(phi, T_base_flange)
        return np.linalg.norm(span, axis=1, keepdims=True)

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        along = self._along(phi, T_base_flange)
        return along[:, None] @ point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        along = self._along(phi, T_base_flange)[:, None]
        R_base_device = self.device.T_base_device[:3, :3]
        return np.concatenate([along @ T_base_flange[:, :3, :3], -along @ R_base_device], axis=-1)

    def _span(self, phi: Floats, T_base_flange: Floats) -> Floats:
        return self.target.in_base(phi[:3], T_base_flange) - self.device.origin_m(phi[3:])

    def _along(self, phi: Floats, T_base_flange: Floats) -> Floats:
        span = self._span(phi, T_base_flange)
        return span / np.linalg.norm(span, axis=1, keepdims=True)
