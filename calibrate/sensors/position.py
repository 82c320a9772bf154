"""Instrument: a tracker or the like that measures the target's position (m) in its own frame."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from calibrate.parameters import Parameter
from calibrate.sensors.device import Device
from calibrate.sensors.target import Target, point_by_twist

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Position:
    """Observed at a pose: x, y, z of the target in the device's frame. Parameters: target 3, device 6."""

    target: Target
    device: Device

    unit = "m"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.target.parameters + self.device.parameters

    def select(self, rows: NDArray[np.intp]) -> Self:
        return self

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        T = self.device.T_base_device_at(phi[3:])
        return (self.target.in_base(phi[:3], T_base_flange) - T[:3, 3]) @ T[:3, :3]

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[3:])[:3, :3].T
        return R_device_base @ point_by_twist(self.target.in_base(phi[:3], T_base_flange))

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[3:])[:3, :3].T
        by_device = self.device.seen_by_parameter(phi[3:], self.target.in_base(phi[:3], T_base_flange))
        return np.concatenate([R_device_base @ T_base_flange[:, :3, :3], by_device], axis=-1)
