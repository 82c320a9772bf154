"""A joint that the file counts the other way round than the rig."""

from collections.abc import Iterator

import numpy as np

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.hypothesis import Hypothesis


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone with its sign changed."""
    for j in range(n_joints):
        sign = np.where(np.arange(n_joints) == j, -1.0, 1.0)
        yield Hypothesis(
            BlunderKind.JOINT_SIGN,
            f"column q{j + 1}_rad",
            f"joint {j + 1} turns against the rig's sense",
            f"change the sign of the column, or turn the axis of joint {j + 1} round in the rig",
            lambda q, s=sign: q * s,
        )
