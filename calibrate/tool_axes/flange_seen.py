"""The flange in the device's frame as the fit has it, with the arm's own error in its uncertainty."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibrate.chain import Chain
from calibrate.rigid import inverse
from calibrate.sensors.device import Device
from calibrate.sensors.position import Position
from calibrate.sensors.target import Target
from calibrate.tool_axes.wrist_fit import WristFit

Floats = NDArray[np.float64]

DEVICE = tuple(f"device.{a}" for a in ("x", "y", "z", "roll", "pitch", "yaw"))


@dataclass(frozen=True)
class FlangeSeen:
    """Where the flange is at the readings `q_rad`, seen by the device."""

    T_device_flange: Floats  # (4, 4)
    q_rad: Floats  # (joint,)
    origin_sigma_m: Floats  # (3,) along the device's axes
    z_sigma_rad: float  # of the flange's z, across it: the larger of both


def flange_seen(found: WristFit, T_base_device: Floats, q_rad: Floats) -> FlangeSeen:
    """At the readings `q_rad` (joint,), from values and covariance of the fit about the start `T_base_device`."""
    n, theta = len(found.arm.parameters), found.fit.theta
    device = found.columns(DEVICE)
    T_flange = found.arm.flange(theta[:n], q_rad[None])[0]
    T = inverse(Device(T_base_device).T_base_device_at(theta[device])) @ T_flange
    columns = np.concatenate([np.arange(n), device])
    C = found.fit.covariance[np.ix_(columns, columns)]
    own = np.concatenate([theta[:n], np.zeros(3), theta[device]])
    at_origin, ahead = (_by(found, T_base_device, own, np.array([0.0, 0.0, z]), q_rad) for z in (0.0, 1.0))
    across = T[:3, :2].T @ (ahead - at_origin)  # what a point 1 m ahead moves by, against the origin
    turn = np.linalg.eigvalsh(across @ C @ across.T)
    return FlangeSeen(T, q_rad, np.sqrt(np.diag(at_origin @ C @ at_origin.T)), float(np.sqrt(max(turn[-1], 0.0))))


def _by(found: WristFit, T_base_device: Floats, own: Floats, point_m: Floats, q_rad: Floats) -> Floats:
    """(3, arm and device) derivative of a flange point as the device sees it."""
    chain = Chain(found.arm, Position(Target(point_m), Device(T_base_device)))
    J = chain.jacobian(own, q_rad[None])[0]
    n = len(found.arm.parameters)
    return np.delete(J, range(n, n + 3), axis=1)
