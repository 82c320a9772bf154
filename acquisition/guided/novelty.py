"""Whether a still probe tells anything new: a cone in another posture, a sphere at another spot, no plane of spots."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.arm import GuidedArm
from acquisition.guided.reading import Reading
from acquisition.guided.target import Cone, SphereSpot, Target

Floats = NDArray[np.float64]
OTHER_RAD = 0.1  # of some joint: nearer postures have the same errors of the arm and show the encoders' scatter only
APART_M = 2e-3  # of two spots of a series: the nearest of 25 that are evenly over half a ball of 31 mm are 4.4 mm apart
FLAT_M = 3e-4  # rms about the plane of all spots: of the first five of those 25 it is 0.85 mm
FLAT_FROM = 5  # spots: with fewer a plane says nothing yet


def nothing_new(arm: GuidedArm, target: Target, q_rad: Floats, taken: Sequence[Reading]) -> str | None:
    """What to do instead, for a person; None where a reading (n,) at the target says something new."""
    if isinstance(target, Cone):
        return _old_posture(q_rad, [one.q_rad for one in taken if one.target == target])
    if isinstance(target, SphereSpot):
        return _old_spot(arm, q_rad, [one.q_rad for one in taken if _of_series(one.target, target)])
    return None


def _of_series(other: Target, target: SphereSpot) -> bool:
    return isinstance(other, SphereSpot) and (other.id, other.series) == (target.id, target.series)


def _old_posture(q_rad: Floats, earlier: Sequence[Floats]) -> str | None:
    if any(np.abs(q_rad - other).max() < OTHER_RAD for other in earlier):
        return f"was read here in this posture; turn some joint by {np.degrees(OTHER_RAD):.0f} deg or more"
    return None


def _old_spot(arm: GuidedArm, q_rad: Floats, earlier: Sequence[Floats]) -> str | None:
    """In one posture the believed arm is off by the same at every spot, so that their distances are good."""
    if not earlier:
        return None
    tips_m = arm.tip_m(np.array([*earlier, q_rad]))
    if np.linalg.norm(tips_m[:-1] - tips_m[-1], axis=1).min() < APART_M:
        return f"was touched here; touch it {1e3 * APART_M:.0f} mm or more beside every earlier spot"
    thick_m = np.linalg.svd(tips_m - tips_m.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(tips_m))
    if len(tips_m) >= FLAT_FROM and thick_m < FLAT_M:
        return "all spots so far and this one lie in one plane, which shows no sphere; touch it out of that plane"
    return None
