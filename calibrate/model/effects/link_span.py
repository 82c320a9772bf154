"""From where to where a link reaches.

In a modified Denavit-Hartenberg table an offset d lies in front of its joint's turn, yet it is the length of the link
behind it: a column stands on its joint. Source: Craig, Introduction to Robotics, 3rd ed., section 3.4 (parameters of
link and joint are assigned by convention, the axis is one).
"""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.rig import ArmModel
from calibrate.model.effects.drivers import Drivers

Floats = NDArray[np.float64]

SHORTEST_M = 0.02  # of a link that bends or grows to any purpose


def link_vectors(drivers: Drivers, link: int) -> Floats:
    """(pose, 3) from start to end of a link (from 1), in the axes of B_link: constant in a rigid link."""
    B = drivers.frames[:, link]
    start = drivers.frames[:, link - 1, :3, 3] - beyond_end_m(drivers, link - 1) * drivers.frames[:, link - 1, :3, 2]
    end = B[:, :3, 3] - beyond_end_m(drivers, link) * B[:, :3, 2]
    return np.einsum("nji,nj->ni", B[:, :3, :3], end - start)


def beyond_end_m(drivers: Drivers, link: int) -> float:
    """How far along its z the origin of B_link stands beyond the end of a link (0: the base)."""
    arm = drivers.rig.arm
    return (arm.joints[link].d_m or 0.0) if arm.model is ArmModel.MDH and link < drivers.n_joints else 0.0
