"""A joint whose zero lies a quarter, half or three quarters of a turn beside that of the rig."""

from collections.abc import Iterator

import numpy as np

from calibrate.blunders.finding import BlunderKind
from calibrate.blunders.hypothesis import Hypothesis


def hypotheses(n_joints: int) -> Iterator[Hypothesis]:
    """Each joint alone, shifted by 90, 180 or -90 degrees. Source: the usual differences between zero conventions."""
    for j in range(n_joints):
        for degrees in (90, 180, -90):
            shift = np.where(np.arange(n_joints) == j, np.radians(degrees), 0.0)
            yield Hypothesis(
                BlunderKind.JOINT_OFFSET,
                f"column q{j + 1}_rad",
                f"zero of joint {j + 1} is {abs(degrees)} deg beside the rig's",
                f"add {np.radians(degrees):.6f} rad to the column or to theta_offset_rad of joint {j + 1}",
                lambda q, s=shift: q + s,
            )
