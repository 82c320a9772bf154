"""Poses of an arm that is measured in free space: anywhere within the limits, above the floor."""

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Arm, forward

Floats = NDArray[np.float64]
CLEAR_M = 0.05  # every joint beyond the second, and the flange, stays this far above the floor
MARGIN = 0.92  # of the limits: nobody drives into the end stop


def free_poses(arm: Arm, number: int, rng: np.random.Generator) -> Floats:
    """Readings (row, n)."""
    middle, half = 0.5 * (arm.lower_rad + arm.upper_rad), 0.5 * MARGIN * (arm.upper_rad - arm.lower_rad)
    found = np.empty((0, arm.n_joints))
    while len(found) < number:
        reading_rad = middle + half * rng.uniform(-1.0, 1.0, (2 * number, arm.n_joints))
        frames = forward(arm, reading_rad + arm.zero_rad)
        height_m = np.minimum(frames.turning[:, 2:, 2, 3].min(axis=1), frames.flange[:, 2, 3])
        found = np.concatenate((found, reading_rad[height_m > CLEAR_M]))
    return found[:number]
