"""The test cube of ISO 9283 and its five poses.

Clause 6.8 of ISO 9283:1998: the edges of the cube are parallel to the base axes, the poses lie in a diagonal plane of
it, which holds two opposite edges: P1 where its diagonals meet, P2 to P5 a tenth of a diagonal away from the ends.
That tenth is confirmed by public third parties; the text of the standard was not at hand (docs/iso9283.md).
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Plane = Literal["x+", "x-", "y+", "y-"]  # rises (or falls) along this base axis; the other one lies in it

FROM_END = 0.1  # of a diagonal, from its end to the pose
CYCLE = (5, 4, 3, 2, 1)  # order in which a cycle visits the poses, from P1 on
CYCLES = 30  # clause 6.9: of pose and distance characteristics
FAR_PAIR = (2, 4)  # ends of one diagonal: distance characteristics
FROM_THREE_SIDES = (1, 2, 4)  # poses at which the multi-directional variation is tested


def cube_poses_m(centre_m: Floats, edge_m: float, plane: Plane) -> Floats:
    """(5, 3) P1 to P5 in the base; P2 and P4, P3 and P5 are the ends of the diagonals."""
    along, up = _spanning(edge_m, plane)
    ends = np.array([along + up, up - along, -along - up, along - up])
    return np.vstack([centre_m, centre_m + (1.0 - 2.0 * FROM_END) * ends])


def cube_corners_m(centre_m: Floats, edge_m: float) -> Floats:
    """(8, 3) in the base."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.asarray(centre_m + 0.5 * edge_m * signs, dtype=np.float64)


def _spanning(edge_m: float, plane: Plane) -> tuple[Floats, Floats]:
    """Half of the edge that the plane holds, and half of its other side."""
    rising = 0 if plane[0] == "x" else 1
    along, up = np.zeros(3), np.array([0.0, 0.0, 0.5 * edge_m])
    along[1 - rising] = 0.5 * edge_m
    up[rising] = 0.5 * edge_m if plane[1] == "+" else -0.5 * edge_m
    return along, up
