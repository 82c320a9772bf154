"""Where the arm will about stand at the poses that a session still has to take: what a forecast counts on.

Postures are those of the rig as drawn; a pose out of reach is left out here, and said by the drawing of the plan.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.aiming.pose import flange_for
from acquisition.aiming.reach import reach
from acquisition.errors import UnreachableError
from acquisition.plan import Block, PoseKey
from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from calibrate.believed import BelievedRig
from calibrate.pose_design.candidates import Candidates

Floats = NDArray[np.float64]

SEED = 1  # of the starts of the inverse kinematics


@dataclass(frozen=True, eq=False)
class Ahead:
    """Poses in the order in which they are taken."""

    poses: Candidates
    keys: tuple[PoseKey, ...]

    def after(self, taken: int) -> Candidates:
        """All but the first so many."""
        return self.poses.take(np.arange(min(taken, len(self.keys)), len(self.keys)))


def ahead_of_blocks(rig: Rig, blocks: Sequence[Block]) -> Ahead:
    """Of a session that aims; repeats stand where their first pose stands."""
    believed, rng = BelievedRig(rig), np.random.default_rng(SEED)
    near_rad = np.array(rig.motion.home_rad)
    found: dict[PoseKey, tuple[Floats, Floats]] = {}
    for block in blocks:
        T = believed.T_base_psd1(block.placement)
        for visit in block.visits:
            flange = flange_for(believed.arm, believed.fixture, T, visit.target)
            try:
                near_rad = reach(believed.arm, flange, near_rad, rng)
            except UnreachableError:
                continue
            for again in range(1 if visit.repeat is None else 3):
                found[visit.key(again)] = near_rad, np.array(visit.target.spots_m)
    keys = tuple(key for block in blocks for key in block.pose_keys() if key in found)
    return Ahead(_poses([found[key] for key in keys], keys, rig.n_joints), keys)


def ahead_of_plan(rig: Rig, plan: PosePlan) -> Ahead:
    """Of a plan of joint poses."""
    believed = BelievedRig(rig)
    each = [(block, pose) for block in plan.block for pose in block.pose]
    keys = tuple(PoseKey(block.placement or 0, block.first_psd or 1, k) for k, (block, _) in enumerate(each))
    found: list[tuple[Floats, Floats]] = []
    for key, (_, pose) in zip(keys, each, strict=True):
        q_rad = np.array(pose.q_rad)
        spots = believed.expect(q_rad, key.placement, key.first).spots_m if pose.spots_m is None else pose.spots_m
        found.append((q_rad, np.array(spots)))
    return Ahead(_poses(found, keys, rig.n_joints), keys)


def _poses(found: list[tuple[Floats, Floats]], keys: Sequence[PoseKey], n_joints: int) -> Candidates:
    return Candidates(
        np.array([q for q, _ in found]).reshape(-1, n_joints),
        np.array([spots for _, spots in found]).reshape(-1, 4),
        np.array([key.placement for key in keys], dtype=np.int64),
        np.array([key.first for key in keys], dtype=np.int64),
    )
