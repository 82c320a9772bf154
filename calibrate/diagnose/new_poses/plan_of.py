"""The poses that separate alternatives as a plan for a session: by place, and in an order that keeps moves short."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.samples import SEAT
from calibrate.diagnose import limits
from calibrate.diagnose.new_poses.contests import NextPoses
from calibrate.diagnose.state.fitted import Fitted

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Key = tuple[int | None, ...]  # placement, first_psd, seat


def plan_of(found: NextPoses, state: Fitted) -> PosePlan:
    """What `calibeam session --plan` takes. Nobody loads an arm on his own: poses are then grouped by payload."""
    samples, like = state.session.samples, found.poses.like
    whole = [samples.integers(name, -1)[like] for name in ("placement", "first_psd", SEAT)]
    payload = samples.column("payload_kg")[like] if "payload_kg" in samples else np.zeros(len(like))
    keys = np.column_stack([*whole, np.nan_to_num(payload)])
    blocks = [_block(found, np.flatnonzero((keys == key).all(axis=1)), key) for key in np.unique(keys, axis=0)]
    return PosePlan(schema=1, rig=state.session.rig.name, block=tuple(blocks), purpose=_purpose(found))


def _block(found: NextPoses, mine: Ints, key: Floats) -> PlannedBlock:
    placement, first, seat = (None if value < 0 else int(value) for value in key[:3])
    return PlannedBlock(
        pose=tuple(_pose(found, i) for i in mine[short_way(found.poses.q_rad[mine])]),
        placement=placement,
        first_psd=1 if first == 1 else 2 if first == 2 else None,
        seat=seat,
        payload_kg=float(key[3]) if key[3] > limits.LOADED_KG else None,
    )


def _pose(found: NextPoses, i: int) -> PlannedPose:
    spots = found.spots_m[i]
    return PlannedPose(
        q_rad=tuple(np.round(found.poses.q_rad[i], 9).tolist()),
        approach=tuple(found.poses.approach[i].astype(int).tolist()),
        spots_m=None if np.isnan(spots).any() else _four(np.round(spots, 9).tolist()),
    )


def _four(values: Sequence[float]) -> tuple[float, float, float, float]:
    a, b, c, d = values
    return a, b, c, d


def short_way(q_rad: Floats) -> Ints:
    """(pose,) order: from each of the poses (pose, joint) to the nearest that is left, by the joint that turns most."""
    left, order = list(range(1, len(q_rad))), [0]
    while left:
        away = np.max(np.abs(q_rad[left] - q_rad[order[-1]]), axis=1)
        order.append(left.pop(int(np.argmin(away))))
    return np.array(order, dtype=np.intp)


def _purpose(found: NextPoses) -> tuple[str, ...]:
    separated = [f"separates {a.compared_with(b)} from {b.compared_with(a)}" for a, b in dict.fromkeys(found.pairs)]
    margin = f"margin to expect of the closest pair: {found.before:.0f} BIC before, {found.after:.0f} with these poses"
    return (*separated, margin)
