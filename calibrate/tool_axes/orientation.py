"""Orientation in the flange: of a 6-D target's own axes, or of the frame that three targets span.

The frame of three targets: origin in the first, x towards the second, z square to the plane of all three so that the
third has a positive y. Its sigma is that of a small turn about each of its own axes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from calibrate.rigid import cross
from calibrate.tool_axes.wrist_fit import TargetRows, WristFit, target_names

Floats = NDArray[np.float64]

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
    along, beside = points_m[1] - points_m[0], points_m[2] - points_m[0]
    normal = cross(along, beside)
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
