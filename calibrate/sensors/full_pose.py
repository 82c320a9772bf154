"""Instrument: a 6-D tracker or camera that measures position and orientation of the target in its own frame.

The orientation is compared as the rotation vector of (expected times inverse of observed), in the device's axes: a
difference of two rotation vectors would break near half a turn. So `expect` needs what was observed, and the
observation to compare with is (x, y, z, 0, 0, 0).
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.parameters import Parameter
from calibrate.rigid import cross_matrix, left_jacobian
from calibrate.sensors.device import Device
from calibrate.sensors.target import Target, point_by_twist

Floats = NDArray[np.float64]

TURN_PLAUSIBLE_RAD = 0.1  # how a target is screwed on, against the drawing
TURNS = ("roll", "pitch", "yaw")


@dataclass(frozen=True)
class FullPose:
    """Observed at a pose: x, y, z (m) and turn from the observed to the expected orientation (rad).

    Parameters: target 6 (point, then rotation vector of its own axes in the flange frame), device 6.
    """

    target: Target
    device: Device
    R_device_target: Floats  # (pose, 3, 3) as observed
    R_flange_target: Floats  # (3, 3) believed
    turn_plausible_rad: float = TURN_PLAUSIBLE_RAD

    unit = "m, rad"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        turns = tuple(Parameter(f"tool.{a}", "rad", self.turn_plausible_rad) for a in TURNS)
        return self.target.parameters + turns + self.device.parameters

    def select(self, rows: NDArray[np.intp]) -> Self:
        return replace(self, R_device_target=self.R_device_target[rows])

    def expect(self, phi: Floats, T_base_flange: Floats) -> Floats:
        T = self.device.T_base_device_at(phi[6:])
        position = (self.target.in_base(phi[:3], T_base_flange) - T[:3, 3]) @ T[:3, :3]
        return np.concatenate([position, self._turn(phi, T_base_flange)], axis=1)

    def by_twist(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        out = np.zeros((len(T_base_flange), 6, 6))
        out[:, :3] = R_device_base @ point_by_twist(self.target.in_base(phi[:3], T_base_flange))
        out[:, 3:, 3:] = inverse_left_jacobian(self._turn(phi, T_base_flange)) @ R_device_base
        return out

    def by_parameter(self, phi: Floats, T_base_flange: Floats) -> Floats:
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        R_device_flange = R_device_base @ T_base_flange[:, :3, :3]
        log = inverse_left_jacobian(self._turn(phi, T_base_flange))
        out = np.zeros((len(T_base_flange), 6, 12))
        out[:, :3, :3] = R_device_flange
        out[:, 3:, 3:6] = log @ R_device_flange @ self.R_flange_target @ left_jacobian(phi[3:6])
        out[:, :3, 6:] = self.device.seen_by_parameter(phi[6:], self.target.in_base(phi[:3], T_base_flange))
        # the device turning by w is the target turning by -w, both in the device's believed axes
        own = R_device_base @ self.device.T_base_device[:3, :3] @ left_jacobian(phi[9:])
        out[:, 3:, 9:] = -log @ own
        return out

    def _turn(self, phi: Floats, T_base_flange: Floats) -> Floats:
        """(pose, 3) rotation vector that leads from the observed to the expected orientation, device axes."""
        R_device_base = self.device.T_base_device_at(phi[6:])[:3, :3].T
        R_flange_target = self.R_flange_target @ Rotation.from_rotvec(phi[3:6]).as_matrix()
        expected = R_device_base @ T_base_flange[:, :3, :3] @ R_flange_target
        return Rotation.from_matrix(expected @ np.swapaxes(self.R_device_target, 1, 2)).as_rotvec().reshape(-1, 3)


def inverse_left_jacobian(rotation_rad: Floats) -> Floats:
    """(pose, 3, 3) of rotation vectors (pose, 3): log(Exp(w) Exp(r)) = r + J^-1 w to first order.

    Source: Sola, Deray, Atchuthan, A micro Lie theory, arXiv 1812.01537, eq. (146).
    """
    angle = np.linalg.norm(rotation_rad, axis=1)
    small = angle < 1e-4  # series of the factor: 1/12 + angle^2/720; the next term is below 1e-20
    safe = np.where(small, 1.0, angle)
    factor = np.where(small, 1.0 / 12.0 + angle**2 / 720.0, 1.0 / safe**2 - 1.0 / (2.0 * safe * np.tan(safe / 2.0)))
    cross_r = cross_matrix(rotation_rad)
    return np.eye(3) - cross_r / 2.0 + factor[:, None, None] * (cross_r @ cross_r)
