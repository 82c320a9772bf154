"""A joint angle that the file counts from another link than the one in front of the joint.

Arms with a parallelogram, and some controllers, give joint 3 against the base or the horizontal instead of against
link 2. Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, ch. 2.9.2 (parallelogram arm).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.hypothesis import Hypothesis

Floats = NDArray[np.float64]

MAKES = {(2, 3): ", as for FANUC"}  # who counts so: docs/robots.md, with sources


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, with the angle of its neighbour in front added or taken away."""
    for j in range(1, n_joints):
        for sign in (-1.0, 1.0):
            mixing = np.eye(n_joints)
            mixing[j, j - 1] = sign
            yield Hypothesis(
                BlunderKind.JOINT_COUPLING,
                f"column q{j + 1}_rad",
                f"joint {j + 1} is coupled with joint {j}: its angle is not counted from link {j}",
                f"in the rig file, write follows = {{ joint = {j}, by = {sign} }} for joint {j + 1}"
                f"{MAKES.get((j, j + 1), '')}, or remove it there",
                lambda q, m=mixing: q @ m.T,
            )
