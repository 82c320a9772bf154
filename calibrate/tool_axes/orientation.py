"""The flange in the device's frame, and orientation in the flange, each with its uncertainty.

Orientation is that of a 6-D target's own axes, or of the frame that three targets span: origin in the first, x towards
the second, z square to the plane of all three so that the third has a positive y. Its sigma is that of a small turn
about each of its own axes. The flange's sigma contains the arm's own error.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.model.chain import SensorChain
from calibrate.model.placement import Device, Target
from calibrate.model.rigid import cross, inverse
from calibrate.model.sensors.position import Position
from calibrate.tool_axes.wrist_fit import TargetRows, WristFit, target_names

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
    chain = SensorChain(found.arm, Position(Target(point_m), Device(T_base_device)))
    J = chain.jacobian(own, q_rad[None])[0]
    n = len(found.arm.parameters)
    return np.delete(J, range(n, n + 3), axis=1)


STEP_M = 1e-6  # of the differences that carry the covariance over: small beside the span of any tool
WIDEST_RAD = 0.1  # sigma of a turn: beyond, the targets are on one line as far as their uncertainty goes
ONE_POINT = (
    "one point has no orientation; measure a 6-D target (columns rx_rad, ry_rad, rz_rad) or three targets of the tool "
    "(column target)"
)
TWO_POINTS = "two targets determine the direction of their line, not the turn about it; measure a third one"
ON_A_LINE = "the first three targets lie on one line within their uncertainty; place the third one beside it"


@dataclass(frozen=True)
class Orientation:
    """R_flange_tool with one sigma (rad) of a turn about each axis of the tool."""

    R_flange_tool: Floats  # (3, 3)
    sigma_rad: Floats  # (3,)
    frame: str  # which axes these are, for a person

    @property
    def rotation_rad(self) -> Floats:
        """(3,) rotation vector."""
        return Rotation.from_matrix(self.R_flange_tool).as_rotvec()


def orientation_of(found: WristFit, targets: tuple[TargetRows, ...], points_m: Floats) -> Orientation | str:
    """Orientation, or the reason why it is not determined. `points_m` (target, 3) as fitted."""
    if targets[0].rotation is not None:
        return _of_target(found, targets[0].number)
    if len(targets) < 3:
        return (ONE_POINT, TWO_POINTS)[len(targets) - 1]
    numbers = [t.number for t in targets[:3]]
    columns = found.columns(tuple(n for k in numbers for n in target_names(k)[:3]))
    covariance = found.fit.covariance[np.ix_(columns, columns)]
    R = spanned(points_m[:3])
    if R is None:
        return ON_A_LINE
    by = _by_points(points_m[:3], R)
    sigma = np.sqrt(np.diag(by @ covariance @ by.T))
    if not np.all(sigma < WIDEST_RAD):
        return ON_A_LINE
    return Orientation(R, sigma, f"origin in target {numbers[0]}, x to target {numbers[1]}, y towards {numbers[2]}")


def spanned(points_m: Floats) -> Floats | None:
    """(3, 3) frame of three points (3, 3) with its axes as columns; None where they are on one line."""
    along, across = points_m[1] - points_m[0], points_m[2] - points_m[0]
    normal = cross(along, across)
    length, area = float(np.linalg.norm(along)), float(np.linalg.norm(normal))
    if area <= 1e-9 * max(length, 1e-9) ** 2:
        return None
    x, z = along / length, normal / area
    return np.stack([x, cross(z, x), z], axis=1)


def _of_target(found: WristFit, number: int) -> Orientation:
    columns = found.columns(target_names(number)[3:])
    turn = found.start_turn[0] @ Rotation.from_rotvec(found.fit.theta[columns]).as_matrix()
    sigma = np.sqrt(np.diag(found.fit.covariance)[columns])
    return Orientation(turn, sigma, f"axes of target {number}")


def _by_points(points_m: Floats, R: Floats) -> Floats:
    """(3, 9) turn of the frame about its own axes by each coordinate."""
    out = np.empty((3, 9))
    for i in range(9):
        moved = points_m.ravel().copy()
        moved[i] += STEP_M
        turned = spanned(moved.reshape(3, 3))
        out[:, i] = 0.0 if turned is None else Rotation.from_matrix(R.T @ turned).as_rotvec() / STEP_M
    return out
