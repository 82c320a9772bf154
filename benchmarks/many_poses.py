"""Joint readings for thousands of flange poses at once: what the inverse kinematics is measured by."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.inverse.closed_form import Starts
from acquisition.motion.inverse.solve import MAX_STEPS, AtPose, Solved, refine, unwound, within
from acquisition.motion.kinematics import Kinematics

Floats = NDArray[np.float64]

MORE_STEPS = 12  # near a singular posture each step halves the error only
FEW_STEPS = 6  # a good start is there after two to four; what takes more waits until those are done
FAR_RAD = 1e3  # further than any way of an arm: what is out of range is tried after all that is in it
RANDOM_STARTS = 8  # at once, for poses that nothing better leads to
RANDOM_ROUNDS = 4


def solve_many(
    arm: Kinematics, T_base_flange: Floats, near_rad: Floats, starts: Starts | None, rng: np.random.Generator
) -> Solved:
    """One solution each within the joint range, tried in the order of nearness to `near_rad` (joint,) or (pose, joint).

    Starts are the closed form's branches; where there is none, or none leads there, random ones.
    """
    near = np.broadcast_to(near_rad, (len(T_base_flange), arm.lower_rad.size))
    q_rad, found = np.full(near.shape, np.nan), np.zeros(len(near), dtype=bool)
    tried = near[:, None]
    if starts is not None:
        branches = _in_order(arm, unwound(starts(T_base_flange), near[:, None], arm), near)
        for steps, k in product((FEW_STEPS, MORE_STEPS), range(branches.shape[1])):
            _try(arm, T_base_flange, branches[:, k : k + 1], near, q_rad, found, steps)
        tried = np.concatenate([branches, tried], axis=1)
    _try(arm, T_base_flange, tried, near, q_rad, found)
    for _ in range(RANDOM_ROUNDS):
        if found.all():
            break
        drawn = rng.uniform(arm.lower_rad, arm.upper_rad, (len(near), RANDOM_STARTS, near.shape[1]))
        _try(arm, T_base_flange, drawn, near, q_rad, found)
    return Solved(q_rad, found)


def _try(
    arm: Kinematics,
    T: Floats,
    starts: Floats,
    near: Floats,
    q_rad: Floats,
    found: NDArray[np.bool_],
    max_steps: int = MAX_STEPS,
) -> None:
    """Fill in those not found yet, each from all its starts (pose, start, joint) at once; the first good one counts."""
    todo = np.flatnonzero(~found)
    if todo.size == 0:
        return
    pose, start = np.nonzero(np.all(np.isfinite(starts[todo]), axis=2))
    solved = refine(arm, AtPose(T[todo[pose]]), starts[todo[pose], start], max_steps)
    q = unwound(solved.q_rad, near[todo[pose]], arm)
    good = np.flatnonzero(solved.found & within(arm, q))
    which, first = np.unique(pose[good], return_index=True)
    q_rad[todo[which]], found[todo[which]] = q[good[first]], True


def _in_order(arm: Kinematics, branches: Floats, near: Floats) -> Floats:
    """(pose, branch, joint) the nearest branch within the range first, those out of range last, NaN behind them."""
    way = np.linalg.norm(branches - near[:, None], axis=2) + FAR_RAD * ~within(arm, branches)
    order = np.argsort(way, axis=1, kind="stable")
    return np.take_along_axis(branches, order[..., None], axis=1)
