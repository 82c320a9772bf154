"""Where the links of an arm are, for many samples at once; where a wanted pose is reached.

Own kinematics, by products of homogeneous matrices: F0 Rz(q1) F1 Rz(q2) ... Fn (see `drawing`).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import about_z

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Arm:
    """One arm, true or believed. n joints; link i follows joint i, link 0 stands before joint 1."""

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
