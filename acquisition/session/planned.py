"""Explicit joint poses of a session before two detectors: go there, from the asked-for side; where it is dark, find the
light.
"""

import numpy as np

from acquisition.centring.aim import clear_of_table
from acquisition.centring.believed import BelievedArm
from acquisition.centring.navigator import Navigator
from acquisition.errors import AcquisitionError, UnreachableError
from acquisition.recording.pose_plan import PlannedPose, PosePlan
from acquisition.session.plan import Floats, PoseKey


def check_planned(plan: PosePlan) -> None:
    """AcquisitionError where a session before two detectors cannot take a block as it is asked for."""
    for number, block in enumerate(plan.block, start=1):
        if block.placement is None or block.first_psd is None:
            raise AcquisitionError(
                f"block {number} of the plan names no placement and first_psd: a session takes poses before the two "
                "detectors; take these by hand, and record them as rows of samples.csv"
            )
        if block.payload_kg:
            raise AcquisitionError(
                f"block {number} of the plan wants a payload of {block.payload_kg:g} kg: a session changes none; "
                "take these poses by hand, or leave the block out"
            )


def go_to_planned(navigator: Navigator, arm: BelievedArm, pose: PlannedPose, key: PoseKey, opposite_rad: float) -> None:
    """To the pose from its side; where it is dark there, to light near it and the spots that were expected."""
    q_rad = np.array(pose.q_rad)
    if not clear_of_table(arm, q_rad):
        at_rad = (np.round(q_rad, 3) + 0.0).tolist()
        raise UnreachableError(f"pose {at_rad} rad: elbow, wrist or laser would touch the table")
    _approach(navigator, arm, q_rad, pose, opposite_rad)
    if navigator.dark(key.first):
        found_rad = navigator.find_near(key.placement, key.first, pose.spots_m or (0.0, 0.0, 0.0, 0.0))
        _approach(navigator, arm, found_rad, pose, opposite_rad)


def _approach(navigator: Navigator, arm: BelievedArm, q_rad: Floats, pose: PlannedPose, opposite_rad: float) -> None:
    """Every joint that has a way comes this way, from inside its range."""
    way = np.array(pose.approach or np.zeros(len(q_rad)))
    before = q_rad - opposite_rad * way
    if np.any(way) and np.all((before >= arm.lower_rad) & (before <= arm.upper_rad)):
        navigator.move(before)
    navigator.move(q_rad)
