"""Chosen poses as a plan for a session: blocks, opposite approaches, and poses that are taken again at their end."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from calibrate.pose_design.candidates import Candidates

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Taken:
    """What a plan takes, in time: candidates, the side each joint comes from, and groups of one pose (0: none)."""

    poses: Ints
    approach: Floats  # (pose, joint) -1 or 1
    repeat: NDArray[np.int64]  # (pose,)


def blocks_of(candidates: Candidates, chosen: Ints) -> list[Ints]:
    """Chosen candidates by place, the fixture moved once to each; there both orders in the pattern 1 2 2 1.

    So neither order comes earlier than the other, and what drifts does not look like the order.
    """
    out: list[Ints] = []
    for place in np.unique(candidates.placement[chosen]):
        mine = chosen[candidates.placement[chosen] == place]
        halves = [
            np.array_split(mine[candidates.first_psd[mine] == k], 2) for k in np.unique(candidates.first_psd[mine])
        ]
        out += [half[0] for half in halves] + [half[1] for half in reversed(halves)]
    return [block for block in out if len(block)]


def taken(candidates: Candidates, in_time: Ints, repeats: int, rng: Generator) -> Taken:
    """At every place its share of `repeats`, at the end: first poses again, every joint from the other side."""
    place = candidates.placement[in_time]
    visits = [in_time[place == one] for one in dict.fromkeys(place.tolist())]
    poses, approach, group = list[Ints](), list[Floats](), list[NDArray[np.int64]]()
    number, left = 0, repeats
    for i, mine in enumerate(visits):
        last = candidates.first_psd[mine[-1]]
        again = np.flatnonzero(candidates.first_psd[mine] == last)[: -(-left // (len(visits) - i))]
        sides, groups = _balanced(len(mine), candidates.q_rad.shape[1], rng), np.zeros(len(mine), dtype=np.int64)
        groups[again] = number + 1 + np.arange(len(again))
        poses += [mine, mine[again]]
        approach += [sides, -sides[again]]
        group += [groups, groups[again]]
        number, left = number + len(again), left - len(again)
    return Taken(np.concatenate(poses), np.concatenate(approach), np.concatenate(group))


def _balanced(count: int, joints: int, rng: Generator) -> Floats:
    """(pose, joint) as many from one side as from the other, each joint for itself."""
    sides = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    return np.stack([rng.permutation(sides) for _ in range(joints)], axis=1)


def plan_of(rig: str, candidates: Candidates, taken: Taken, purpose: tuple[str, ...]) -> PosePlan:
    """What `calibeam session --plan` runs."""
    place, first = candidates.placement[taken.poses], candidates.first_psd[taken.poses]
    changes = np.flatnonzero((np.diff(place, prepend=-1) != 0) | (np.diff(first, prepend=-1) != 0))
    blocks = [
        PlannedBlock(
            pose=tuple(_pose(candidates, taken, int(i)) for i in mine),
            placement=int(place[mine[0]]) or None,
            first_psd=1 if first[mine[0]] == 1 else 2 if first[mine[0]] == 2 else None,
        )
        for mine in np.split(np.arange(len(taken.poses)), changes[1:])
    ]
    return PosePlan(schema=1, rig=rig, block=tuple(blocks), purpose=purpose)


def _pose(candidates: Candidates, taken: Taken, i: int) -> PlannedPose:
    pose = int(taken.poses[i])
    spots = None
    if candidates.spots:
        a, b, c, d = np.round(candidates.reading[pose], 9).tolist()
        spots = (a, b, c, d)
    return PlannedPose(
        q_rad=tuple(np.round(candidates.q_rad[pose], 9).tolist()),
        approach=tuple(taken.approach[i].astype(int).tolist()),
        spots_m=spots,
        repeat=int(taken.repeat[i]) or None,
    )
