"""Play between two surfaces, with the history of the motion.

The play operator (Visintin, "Differential Models of Hysteresis", 1994, section III.2): the driven side stays where it
is until one flank of the driving side meets it, w <- min(max(w, u - b/2), u + b/2).
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def played(via_rad: Floats, goal_rad: Floats, play_rad: float) -> Floats:
    """Driven less driving side at the goal of each row, (row,), for one joint.

    The driving side goes from goal to `via_rad` and on to the next `goal_rad`, both (row,), row by row; the driven side
    first stands in the middle.
    """
    half_rad = 0.5 * play_rad
    driven_rad = via_rad[0]
    behind_rad = np.empty_like(goal_rad)
    for row, (via, goal) in enumerate(zip(via_rad.tolist(), goal_rad.tolist(), strict=True)):
        for driving in (via, goal):
            driven_rad = min(max(driven_rad, driving - half_rad), driving + half_rad)
        behind_rad[row] = driven_rad - goal
    return behind_rad
