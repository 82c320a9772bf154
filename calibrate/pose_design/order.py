"""The order of a plan in time, so that what drifts does not look like geometry.

A drift grows along with the number of the pose: of the laser's mount, of the joint zeros, of the fixture. Geometry
absorbs the share d'Hd / d'd of such a column d, H = X (X'X + beliefs)^-1 X'. Poses of a block change places until the
mean share is small; moves count a little, too, so that the arm does not travel for nothing. Source: run orders free of
trend, Cox, Biometrika 38(3/4), 1951; here for a linear trend by search.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from calibrate.pose_design.candidates import Candidates
from calibrate.pose_design.information import Information

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SWAPS = 12_000
TRAVEL = 0.02  # of the loss for a mean move of 1 rad: absorbed shares differ by some tenths
DRIFTING = ("laser.", "placement")  # names of unknowns that may drift, beside the joint zeros
SEEN = 1e-9  # of the largest column: one that these poses hardly show is no drift


@dataclass(frozen=True)
class Ordered:
    """`poses` in time. Shares of drifts that geometry would absorb: of the plan, and of the order it began with."""

    poses: Ints
    absorbed: float
    absorbed_before: float
    move_rad: float  # mean over the moves of the joint that turns most
    move_before_rad: float


def ordered(found: Information, candidates: Candidates, blocks: list[Ints], rng: Generator) -> Ordered:
    """Candidates of each block; blocks stay in their order, and poses change places within blocks of one kind."""
    q_rad, place = candidates.q_rad, candidates.placement
    kind = 2 * place + candidates.first_psd
    begun = [block[_short_way(q_rad[block])] for block in blocks]
    poses = np.concatenate(begun)
    of_block = kind[poses]
    drift, hat = _drifts(found, poses, place[poses])
    at = np.arange(len(poses))  # at[i]: pose that is taken as number i
    before = _absorbed(drift, hat, at)
    loss = before + TRAVEL * _move(q_rad[poses])
    for _ in range(SWAPS):
        i = int(rng.integers(len(poses)))
        mates = np.flatnonzero(of_block == of_block[i])
        j = int(mates[rng.integers(len(mates))])
        if i == j:
            continue
        tried = at.copy()
        tried[[i, j]] = tried[[j, i]]
        new = _absorbed(drift, hat, tried) + TRAVEL * _move(q_rad[poses[tried]])
        if new < loss:
            at, loss = tried, new
    share = _absorbed(drift, hat, at)
    return Ordered(poses[at], share, before, _move(q_rad[poses[at]]), _move(q_rad[poses]))


@dataclass(frozen=True)
class _Drifts:
    """Columns of what may drift; what belongs to one place drifts about its own middle: before, nothing was there."""

    columns: Floats  # (pose, k, drift)
    standing: NDArray[np.bool_]  # (place, pose)
    of_place: NDArray[np.bool_]  # (drift,)


def _drifts(found: Information, poses: Ints, place: NDArray[np.int64]) -> tuple[_Drifts, Floats]:
    """And the hat matrix of the poses' readings (pose k, pose k)."""
    rows = found.rows[poses]
    names = [p.name for p in found.parameters]
    own = [i for i, n in enumerate(names) if n.startswith(DRIFTING) or n.endswith(".zero")]
    size = np.sqrt(np.sum(rows[:, :, own] ** 2, axis=(0, 1)))
    own = [i for i, s in zip(own, size.tolist(), strict=True) if s > SEEN * float(size.max(initial=0.0))]
    X = rows.reshape(-1, found.n)
    hat = X @ np.linalg.solve(X.T @ X + found.before, X.T)
    of_place = np.array([names[i].startswith("placement") for i in own])
    return _Drifts(rows[:, :, own], place == np.unique(place)[:, None], of_place), hat


def _absorbed(drift: _Drifts, hat: Floats, at: Ints) -> float:
    """Mean over the drifts; number i in time is pose at[i]."""
    n = len(at)
    time = np.empty(n)
    time[at] = np.linspace(-1.0, 1.0, n)
    middles = (drift.standing @ time) / drift.standing.sum(axis=1)
    own = time - middles @ drift.standing
    by = np.where(drift.of_place, own[:, None], time[:, None])
    d = (by[:, None, :] * drift.columns).reshape(len(hat), -1)
    return float(np.mean(np.sum(d * (hat @ d), axis=0) / np.sum(d * d, axis=0)))


def _move(q_rad: Floats) -> float:
    return float(np.mean(np.max(np.abs(np.diff(q_rad, axis=0)), axis=1))) if len(q_rad) > 1 else 0.0


def _short_way(q_rad: Floats) -> Ints:
    """From each pose to the nearest that is left, by the joint that turns most."""
    left, order = list(range(1, len(q_rad))), [0]
    while left:
        away = np.max(np.abs(q_rad[left] - q_rad[order[-1]]), axis=1)
        order.append(left.pop(int(np.argmin(away))))
    return np.array(order, dtype=np.intp)
