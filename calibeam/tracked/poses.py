"""The poses of a session with a tracker: drawn evenly over the joints' ranges, by short ways, some of them repeated."""

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import RigFileError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import Rig
from calibeam.motion.reachable_poses import candidates_of, way_is_clear

Floats = NDArray[np.float64]
SPARE = 3  # candidates for each pose that is wanted: of many the next one is near
PER_CANDIDATE = 6  # `candidates_of` draws so many for each that it is asked for
REPEATED_EVERY = 8  # poses: one of so many is taken twice more, each joint from either side


def drawn_plan(rig: Rig, poses: int, seed: int) -> PosePlan:
    """A plan of so many poses and their repeats, each the nearest one by a clear way from the one before.

    RigFileError where fewer can be reached.
    """
    if rig.device is None:
        raise RigFileError(
            f"rig {rig.name}: no [device]; poses are drawn for an instrument that stands somewhere, so say roughly "
            "where, or give a --plan"
        )
    rng = np.random.default_rng(seed)
    left = list(candidates_of(rig, -(-SPARE * poses // PER_CANDIDATE), rng).q_rad)
    at, chosen = np.array(rig.motion.home_rad), list[Floats]()
    while left and len(chosen) < poses:
        left.sort(key=lambda q: float(np.max(np.abs(q - at))))
        near = next((k for k, q in enumerate(left) if way_is_clear(rig, at, q)), None)
        if near is None:
            break
        at = left.pop(near)
        chosen.append(at)
    if len(chosen) < poses:
        raise RigFileError(
            f"rig {rig.name}: {len(chosen)} of {poses} poses are reached by clear ways from home; ask for fewer, or "
            "look at home_rad and the boxes of [motion]"
        )
    return PosePlan(1, rig.name, (PlannedBlock(tuple(_with_repeats(chosen))),))


def _with_repeats(chosen: list[Floats]) -> list[PlannedPose]:
    out: list[PlannedPose] = []
    for number, q in enumerate(chosen):
        values = tuple(map(float, q))
        if number % REPEATED_EVERY != 0:
            out.append(PlannedPose(values))
            continue
        group = 1 + number // REPEATED_EVERY
        out += [PlannedPose(values, (way,) * len(values), repeat=group) for way in (1, -1, 1)]
    return out
