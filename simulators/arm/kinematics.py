"""Rigid motions of many samples at once, as homogeneous matrices (row, 4, 4); where the links of an arm are, and joint
angles that bring it where it is wanted.

Own kinematics, by products of homogeneous matrices: F0 Rz(q1) F1 Rz(q2) ... Fn (see `drawing`). Inverse: Newton steps
on many rows at once, damped least squares with a limited step (Wampler, IEEE Trans. SMC 16 (1986) 93); rows that arrive
leave the loop.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]


def turned(rotation_rad: ArrayLike) -> Floats:
    """A turn about the origin: rotation vectors (row, 3) to (row, 4, 4)."""
    rotation = np.asarray(rotation_rad, dtype=np.float64)
    motion = np.zeros((*rotation.shape[:-1], 4, 4))
    motion[..., :3, :3] = Rotation.from_rotvec(rotation.reshape(-1, 3)).as_matrix().reshape(*rotation.shape[:-1], 3, 3)
    motion[..., 3, 3] = 1.0
    return motion


def shifted(shift_m: ArrayLike) -> Floats:
    """A shift: (row, 3) to (row, 4, 4)."""
    shift = np.asarray(shift_m, dtype=np.float64)
    motion = np.zeros((*shift.shape[:-1], 4, 4))
    motion[..., range(4), range(4)] = 1.0
    motion[..., :3, 3] = shift
    return motion


def moved(shift_m: ArrayLike, rotation_rad: ArrayLike) -> Floats:
    """A turn about the origin, then a shift: both (row, 3), to (row, 4, 4)."""
    motion = turned(rotation_rad)
    motion[..., :3, 3] = shift_m
    return motion


def turned_about(point_m: ArrayLike, rotation_rad: ArrayLike) -> Floats:
    """A turn about a line through `point_m` (3,) or (row, 3)."""
    point = np.asarray(point_m, dtype=np.float64)
    motion = turned(rotation_rad)
    motion[..., :3, 3] = point - np.einsum(
        "...ij,...j->...i", motion[..., :3, :3], np.broadcast_to(point, motion[..., :3, 3].shape)
    )
    return motion


def inverse(motion: Floats) -> Floats:
    """The motion back, (..., 4, 4)."""
    back = np.zeros_like(motion)
    back[..., :3, :3] = np.swapaxes(motion[..., :3, :3], -1, -2)
    back[..., :3, 3] = -np.einsum("...ij,...j->...i", back[..., :3, :3], motion[..., :3, 3])
    back[..., 3, 3] = 1.0
    return back


def about_z(angle_rad: Floats) -> Floats:
    """Turns about z: (row,) to (row, 4, 4)."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    motion = np.zeros((*angle_rad.shape, 4, 4))
    motion[..., 0, 0] = cosine
    motion[..., 1, 1] = cosine
    motion[..., 0, 1] = -sine
    motion[..., 1, 0] = sine
    motion[..., 2, 2] = 1.0
    motion[..., 3, 3] = 1.0
    return motion


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm, true or assumed. n joints; link i follows joint i, link 0 stands before joint 1."""

    fixed: Floats  # (n + 1, 4, 4)
    zero_rad: Floats  # (n,) true angle less reading of a perfect joint
    lower_rad: Floats  # (n,) of the reading
    upper_rad: Floats
    mass_kg: Floats  # (n,)
    com_m: Floats  # (n, 3) in the frame that turns with the joint
    tool_kg: float
    tool_com_m: Floats  # (3,) in the flange frame
    gravity_m_s2: Floats  # (3,) in the base frame

    @property
    def n_joints(self) -> int:
        return len(self.zero_rad)


@dataclass(frozen=True, eq=False)
class Frames:
    """Poses in the base frame."""

    turning: Floats  # (row, n, 4, 4) frames that turn with the joints, z the axis
    flange: Floats  # (row, 4, 4)


def forward(
    arm: Arm, joint_rad: Floats, *, foot: Floats | None = None, links: Mapping[int, Floats] | None = None
) -> Frames:
    """All frames for true joint angles (row, n).

    `foot`: motion (row, 4, 4) of the arm's foot; `links`: motions (row, 4, 4) by link, each in the frame at its start.
    """
    moving = links or {}
    rows, n = joint_rad.shape
    spin = about_z(joint_rad)
    turning = np.empty((rows, n, 4, 4))
    here = np.broadcast_to(np.eye(4), (rows, 4, 4)) if foot is None else foot
    for link in range(n + 1):
        if link in moving:
            here = here @ moving[link]
        here = here @ arm.fixed[link]
        if link < n:
            here = here @ spin[:, link]
            turning[:, link] = here
    return Frames(turning, here)


def jacobian(frames: Frames, point_m: Floats) -> Floats:
    """(row, 6, n): velocity of the point (row, 3) above, turning below, by each joint speed, in the base frame."""
    axes = frames.turning[:, :, :3, 2]
    arms_m = point_m[:, np.newaxis] - frames.turning[:, :, :3, 3]
    return np.concatenate((np.cross(axes, arms_m), axes), axis=-1).swapaxes(-1, -2)


Marks = NDArray[np.bool_]
STEPS = 40
LARGEST_STEP_RAD = 0.6
DAMPING = 1e-6  # of the squared singular values; m and rad are alike for an arm of about a metre
ARRIVED = 1e-11  # m, rad: far below any instrument


def reach_pose(arm: Arm, wanted: Floats, start_rad: Floats) -> tuple[Floats, Marks]:
    """True joint angles (row, n) with the flange at `wanted` (row, 4, 4), from `start_rad`; which rows arrived."""

    def step(rows: NDArray[np.intp], joint_rad: Floats) -> tuple[Floats, Floats]:
        frames = forward(arm, joint_rad)
        flange = frames.flange
        miss_m = wanted[rows, :3, 3] - flange[:, :3, 3]
        turn = wanted[rows, :3, :3] @ flange[:, :3, :3].swapaxes(-1, -2)
        miss = np.concatenate((miss_m, Rotation.from_matrix(turn).as_rotvec()), axis=1)
        return miss, jacobian(frames, flange[:, :3, 3])

    return _newton(step, start_rad)


def reach_point(arm: Arm, point_m: Floats, wanted_m: Floats, start_rad: Floats) -> tuple[Floats, Marks]:
    """True joint angles with the flange-fixed point (3,) at `wanted_m` (row, 3); the nearest to the start."""

    def step(rows: NDArray[np.intp], joint_rad: Floats) -> tuple[Floats, Floats]:
        frames = forward(arm, joint_rad)
        here_m = frames.flange[:, :3, :3] @ point_m + frames.flange[:, :3, 3]
        return wanted_m[rows] - here_m, jacobian(frames, here_m)[:, :3]

    return _newton(step, start_rad)


def _newton(
    step: Callable[[NDArray[np.intp], Floats], tuple[Floats, Floats]], start_rad: Floats
) -> tuple[Floats, Marks]:
    joint_rad = start_rad.copy()
    arrived = np.zeros(len(joint_rad), dtype=np.bool_)
    rows = np.arange(len(joint_rad))
    for _ in range(STEPS):
        miss, slope = step(rows, joint_rad[rows])
        there = np.abs(miss).max(axis=1) < ARRIVED
        arrived[rows[there]] = True
        rows, miss, slope = rows[~there], miss[~there], slope[~there]
        if not rows.size:
            break
        square = slope @ slope.swapaxes(-1, -2) + DAMPING * np.eye(miss.shape[1])
        move_rad = np.einsum("rij,ri->rj", slope, np.linalg.solve(square, miss[..., np.newaxis])[..., 0])
        largest = np.abs(move_rad).max(axis=1, keepdims=True)
        joint_rad[rows] += move_rad * np.minimum(1.0, LARGEST_STEP_RAD / np.maximum(largest, 1e-300))
    return joint_rad, arrived


def within_limits(arm: Arm, joint_rad: Floats) -> tuple[Floats, Marks]:
    """Readings (row, n), each turned by whole turns into its limits where that is possible; rows where it is."""
    reading_rad = joint_rad - arm.zero_rad
    turn = 2.0 * np.pi
    reading_rad = reading_rad - turn * np.floor((reading_rad - arm.lower_rad) / turn)
    return reading_rad, np.all(reading_rad <= arm.upper_rad, axis=1)
