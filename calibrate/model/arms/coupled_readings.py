"""Joints whose reported angle is not counted from the link in front: `follows` of the rig file.

angle_i = reading_i + by reading_k: a controller that reports joint 3 against the horizontal follows joint 2. The angle
from the link in front is what turns the frames; everything that a person or a controller reads or writes is a reading.
Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, ch. 2.9.2 (arm with parallelogram).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from acquisition.recording.rig import Arm

Floats = NDArray[np.float64]


def by_reading(arm: Arm) -> Floats | None:
    """(joint, joint) derivative of the angles by the readings; None where no joint follows another one."""
    if all(joint.follows is None for joint in arm.joints):
        return None
    out = np.eye(len(arm.joints))
    for i, joint in enumerate(arm.joints):
        if joint.follows is not None:
            out[i, joint.follows.joint - 1] = joint.follows.by
    return out


def uncoupled(matrix: Floats | None, q_rad: Floats) -> Floats:
    """Angles (..., joint) from the links in front, for readings (..., joint)."""
    return q_rad if matrix is None else q_rad @ matrix.T


def recoupled(matrix: Floats | None, angle_rad: Floats) -> Floats:
    """Readings (..., joint) of angles (..., joint)."""
    return angle_rad if matrix is None else angle_rad @ np.linalg.inv(matrix).T


def by_readings(matrix: Floats | None, by_angle: Floats) -> Floats:
    """A derivative (..., joint) by the angles as one by the readings."""
    return by_angle if matrix is None else by_angle @ matrix
