"""Poses that could be measured, with the reading expected there, and the plan of a session of chosen ones.

Candidates are rows of a session that was never measured. A plan has blocks, opposite approaches, and poses that are
measured again at the end of their block.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.samples import POSITION, SPOTS, per_joint

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

POSE_S = 8.0  # from one reading to the next: of an emulated session at 1 rad/s; it sets how fast a drift is taken to be


@dataclass(frozen=True)
class Candidates:
    """One row a pose. `placement` and `first_psd` are 0 where a position is measured instead of spots."""

    q_rad: Floats  # (pose, joint)
    reading: Floats  # (pose, k) expected: spots (4) or a position (3), m
    placement: Ints  # (pose,)
    first_psd: Ints  # (pose,)

    def __len__(self) -> int:
        return len(self.q_rad)

    @property
    def spots(self) -> bool:
        """Whether the instrument is a dual PSD."""
        return self.reading.shape[1] == len(SPOTS)

    def take(self, rows: NDArray[np.intp]) -> "Candidates":
        """Some of them, in this order."""
        return Candidates(self.q_rad[rows], self.reading[rows], self.placement[rows], self.first_psd[rows])

    def samples(self, approach: Floats | None = None, repeat: Ints | None = None) -> Samples:
        """As a table that a session would leave, read in this order; `approach` (pose, joint), `repeat` (pose,)."""
        n, joints = self.q_rad.shape
        columns = {"t_s": POSE_S * np.arange(n, dtype=np.float64)}
        columns |= dict(zip(per_joint("q", "_rad", joints), self.q_rad.T, strict=True))
        if self.spots:
            columns |= {"placement": self.placement.astype(float), "first_psd": self.first_psd.astype(float)}
        columns |= dict(zip(SPOTS if self.spots else POSITION, self.reading.T, strict=True))
        if approach is not None:
            columns |= dict(zip(per_joint("approach", "", joints), approach.T, strict=True))
        if repeat is not None:
            columns["repeat"] = np.where(repeat > 0, repeat, np.nan)
        return Samples(columns, joints)


Rows = NDArray[np.intp]


@dataclass(frozen=True)
class Taken:
    """What a plan takes, in time: candidates, the side each joint comes from, and groups of one pose (0: none)."""

    poses: Rows
    approach: Floats  # (pose, joint) -1 or 1
    repeat: NDArray[np.int64]  # (pose,)


def blocks_of(candidates: Candidates, chosen: Rows) -> list[Rows]:
    """Chosen candidates by place, the fixture moved once to each; there both orders in the pattern 1 2 2 1.

    So neither order comes earlier than the other, and what drifts does not resemble the order.
    """
    out: list[Rows] = []
    for place in np.unique(candidates.placement[chosen]):
        mine = chosen[candidates.placement[chosen] == place]
        halves = [
            np.array_split(mine[candidates.first_psd[mine] == k], 2) for k in np.unique(candidates.first_psd[mine])
        ]
        out += [half[0] for half in halves] + [half[1] for half in reversed(halves)]
    return [block for block in out if len(block)]


def taken(candidates: Candidates, in_time: Rows, repeats: int, rng: Generator) -> Taken:
    """At every place its share of `repeats`, at the end: first poses again, every joint from the other side."""
    place = candidates.placement[in_time]
    visits = [in_time[place == one] for one in dict.fromkeys(place.tolist())]
    poses, approach, group = list[Rows](), list[Floats](), list[NDArray[np.int64]]()
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
