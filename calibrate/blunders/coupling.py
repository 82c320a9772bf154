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


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, with the angle of its neighbour in front added or taken away."""
    for j in range(1, n_joints):
        for sign, word in ((-1.0, "subtract"), (1.0, "add")):
            mixing = np.eye(n_joints)
            mixing[j, j - 1] = sign
            yield Hypothesis(
                BlunderKind.JOINT_COUPLING,
                f"column q{j + 1}_rad",
                f"joint {j + 1} is coupled with joint {j}: its angle is not counted from link {j}",
                f"{word} q{j}_rad {'from' if sign < 0 else 'to'} the column",
                lambda q, m=mixing: q @ m.T,
            )
