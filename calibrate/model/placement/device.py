"""The measuring device (tracker, camera, drum) in the base: a frame with six unknowns, shared by all that it measures.

Corrections are shifts along, and a rotation vector about, the device's own assumed axes.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.model.parameters import Parameter
from calibrate.model.placement.target import point_by_twist
from calibrate.model.rigid import pose_offset, pose_offset_twists, transform
from calibrate.model.sensor_model import About

Floats = NDArray[np.float64]

PLAUSIBLE_M = 0.05  # a start found in closed form, or taken from the rig: nominal arms are off by millimetres
PLAUSIBLE_RAD = 0.05
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
N_PARAMETERS = 6


@dataclass(frozen=True)
class Device:
    """Assumed place; `prior` (m, rad) is one sigma of it, None: no opinion, the data find it."""

    T_base_device: Floats  # (4, 4)
    prior: tuple[float, float] | None = None
    name: str = "device"  # first part of the names of its parameters

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(self._parameter(i, a) for i, a in enumerate(AXES))

    @property
    def origin_parameters(self) -> tuple[Parameter, ...]:
        """Of an instrument that knows only a point of the device: shifts, along the assumed axes."""
        return self.parameters[:3]

    def T_base_device_at(self, deviation: Floats) -> Floats:
        """(4, 4) the frame for corrections (6,)."""
        return self.T_base_device @ pose_offset(deviation)

    def origin_m(self, shift_m: Floats) -> Floats:
        """(3,) the device's origin in the base for corrections (3,)."""
        return self.T_base_device[:3, 3] + self.T_base_device[:3, :3] @ shift_m

    def seen_by_parameter(self, deviation: Floats, point_m: Floats) -> Floats:
        """(pose, 3, 6) derivative, by the corrections, of base points (pose, 3) as the device sees them.

        The device moving by a twist is the point moving by its opposite.
        """
        R = self.T_base_device_at(deviation)[:3, :3]
        return -(R.T @ point_by_twist(point_m) @ pose_offset_twists(self.T_base_device, deviation))

    def about(self) -> About:
        """Origin and rotation vector in the base that the corrections start from."""
        T = self.T_base_device
        return {self.name: (*T[:3, 3].tolist(), *Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist())}

    def placed(self, about: About) -> Self:
        """The same where a model's corrections start from."""
        found = about.get(self.name)
        return self if found is None else replace(self, T_base_device=transform(found[:3], found[3:]))

    def _parameter(self, i: int, axis: str) -> Parameter:
        unit, plausible = ("m", PLAUSIBLE_M) if i < 3 else ("rad", PLAUSIBLE_RAD)
        if self.prior is None:
            return Parameter(f"{self.name}.{axis}", unit, plausible)
        return Parameter(f"{self.name}.{axis}", unit, max(plausible, self.prior[i // 3]), prior=self.prior[i // 3])
