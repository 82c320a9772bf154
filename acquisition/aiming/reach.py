"""Joint readings that bring the flange of a believed arm to a pose, near where it stands and clear of the table."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from acquisition.believed import BelievedArm
from acquisition.errors import UnreachableError
from acquisition.motion.inverse.solve import AtPose, refine, unwound, within

Floats = NDArray[np.float64]

TABLE_M = 0.02  # neither the elbow nor a joint beyond it may come lower than this above the base plane
ELBOW = 2  # frame behind the second link


def reach(
    arm: BelievedArm, T_base_flange: Floats, near_rad: Floats, rng: np.random.Generator, starts: int = 12
) -> Floats:
    """Joint readings (joint,) that put the flange there, the first found close to `near_rad`. UnreachableError.

    `starts` are tried around `near_rad`, and where none leads there as many anywhere in the joint range.
    """
    goal = AtPose(T_base_flange[None])
    for start in _starts(arm, near_rad, rng, starts):
        q_rad = unwound(refine(arm, goal, start[None]).q_rad[0], near_rad, arm)
        if within(arm, q_rad) and clear_of_table(arm, q_rad):
            return q_rad
    x, y, z = T_base_flange[:3, 3]
    raise UnreachableError(
        f"no joint position within limits puts the flange at ({x:.3f}, {y:.3f}, {z:.3f}) m with the asked-for roll "
        f"({2 * starts} starts tried); choose another stand-off or roll, or move the fixture"
    )


def clear_of_table(arm: BelievedArm, q_rad: Floats) -> bool:
    """Whether elbow, wrist and laser stay above the base plane."""
    origin_m, _ = arm.beam(q_rad)
    return bool(np.min(arm.frames(q_rad[None])[0, ELBOW:, 2, 3]) > TABLE_M and origin_m[2] > TABLE_M)


def _starts(arm: BelievedArm, near_rad: Floats, rng: np.random.Generator, starts: int) -> Iterator[Floats]:
    yield near_rad
    for k in range(starts - 1):
        yield near_rad + rng.normal(0.0, 0.3 + 0.1 * k, near_rad.size)
    for _ in range(starts):
        yield rng.uniform(arm.lower_rad, arm.upper_rad)
