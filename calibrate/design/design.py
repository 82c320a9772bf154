"""A design: poses chosen from candidates, how many are enough, their order in time, and its file.

The order keeps a drift from being mistaken for geometry. A drift grows with the number of the pose: of the laser's
mount, of the joint zeros, of the fixture. Geometry absorbs the share d'Hd / d'd of such a column d, H = X (X'X +
priors)^-1 X'. Poses of a block change places until the mean share is small; the length of the moves counts a little,
too. Source: run orders free of trend, Cox, Biometrika 38(3/4), 1951; here for a linear trend by search.

The file is version 1: docs/design-of-poses.md explains every key. SI, units in the names.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from calibrate.design.candidates import (
    Candidates,
    Taken,
    blocks_of,
    plan_of,
    taken,
)
from calibrate.design.exchange import (
    CRITERIA,
    Choice,
    choose,
    one_by_one,
)
from calibrate.design.information import Information
from calibrate.design.places import Places
from calibrate.design.seen import Seen
from calibrate.diagnose.assess import Named
from calibrate.diagnose.new_poses import short_way
from calibrate.errors import DataError

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
    begun = [block[short_way(q_rad[block])] for block in blocks]
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


Progress = Callable[[str, int, int], None]

STARTS = ("d", "o3")  # criteria whose choices are further starts: cheap, and they spread poses
DRAWN = 20  # random choices to compare with
LONGEST = 2.5  # of the asked-for number: how far the curve is drawn
ENOUGH = 0.75  # of -d ln error / d ln poses: below, more poses do little but average noise, for which it is 0.5

AHEAD = 1.5  # times as many poses, between which the steepness is taken


@dataclass(frozen=True)
class DesignOptions:
    """How a plan is to be."""

    poses: int = 60  # readings, repeats among them
    repeats: int = 6
    criterion: str = "free-space"
    seed: int = 1


@dataclass(frozen=True)
class ErrorByPoses:
    """Predicted error over the workspace by number of poses, m: chosen one by one, and drawn at random (median)."""

    poses: NDArray[np.intp]
    chosen_m: Floats
    random_m: Floats
    enough: int | None  # from here on more poses do little but average noise; None: not within the curve


@dataclass(frozen=True)
class Design:
    """A plan and what it promises. Lengths are rms of the target over the workspace, three axes together."""

    asked: DesignOptions
    candidates: Candidates
    information: Information
    choice: Choice
    in_time: Ordered
    taken: Taken
    plan: PosePlan
    curve: ErrorByPoses
    free_space_m: float
    random_m: float  # as many poses drawn from the candidates, median
    scale_sigma: float


def design(
    rig: Rig,
    candidates: Candidates,
    found: Information,
    asked: DesignOptions,
    progress: Progress = lambda what, done, total: None,
) -> Design:
    """DataError for an unknown criterion, or fewer candidates than poses."""
    distinct = asked.poses - asked.repeats
    _check(rig, candidates, asked)
    rng = np.random.default_rng(asked.seed)
    others = [CRITERIA[name](found) for name in STARTS if name != asked.criterion]
    choice = choose(
        CRITERIA[asked.criterion](found),
        distinct,
        len(candidates),
        rng,
        others=others,
        progress=lambda done, total: progress("choosing poses", done, total),
    )
    in_time = ordered(found, candidates, blocks_of(candidates, choice.poses), rng)
    shots = taken(candidates, in_time.poses, asked.repeats, rng)
    information = found.of(shots.poses)
    promised = found.free_space_m(information)
    drawn = _random_m(found, asked.poses, rng)
    purpose = (
        f"{asked.poses} poses by criterion {asked.criterion}: predicted error over the workspace "
        f"{1e6 * promised:.1f} µm "
        f"rms, random poses {1e6 * drawn:.1f} µm",
    )
    plan = plan_of(rig.name, candidates, shots, purpose)
    curve = _curve(found, asked, rng)
    scale = found.scale_sigma(information)
    return Design(asked, candidates, found, choice, in_time, shots, plan, curve, promised, drawn, scale)


def _check(rig: Rig, candidates: Candidates, asked: DesignOptions) -> None:
    if asked.criterion not in CRITERIA:
        raise DataError(f"criterion '{asked.criterion}': there are {', '.join(CRITERIA)}")
    if not 0 <= asked.repeats < asked.poses:
        raise DataError(f"{asked.poses} poses with {asked.repeats} repeats: give more poses than repeats")
    if len(candidates) < asked.poses:
        raise DataError(
            f"rig {rig.name}: {len(candidates)} candidates for {asked.poses} poses; raise --candidates, or move what "
            "is out of reach"
        )


def _random_m(found: Information, poses: int, rng: np.random.Generator) -> float:
    total = len(found.rows)
    drawn = [found.of(rng.choice(total, min(poses, total), replace=False)) for _ in range(DRAWN)]
    return float(np.median([found.free_space_m(A) for A in drawn]))


def _curve(found: Information, asked: DesignOptions, rng: np.random.Generator) -> ErrorByPoses:
    """One by one by the determinant, whatever the criterion: one list for all numbers."""
    total = len(found.rows)
    most = min(total, max(20, round(LONGEST * asked.poses)))
    chosen, _ = one_by_one(CRITERIA["d"](found), most, total)
    at = np.unique(np.linspace(max(4, most // 30), most, 30).astype(np.intp))
    error = np.array([found.free_space_m(found.of(np.array(chosen[:n]))) for n in at])
    drawn = np.array([_random_m(found, int(n), rng) for n in at])
    return ErrorByPoses(at, error, drawn, enough_of(at, error))


def enough_of(poses: NDArray[np.intp], error_m: Floats) -> int | None:
    """The number behind the last one from which half as many more make it steeper than ENOUGH; a choice has steps."""
    more = np.interp(np.log(AHEAD * poses), np.log(poses), np.log(error_m))
    steep = (np.log(error_m) - more) / np.log(AHEAD) > ENOUGH
    ahead = AHEAD * poses <= poses[-1]
    last = int(np.flatnonzero(steep & ahead)[-1]) + 1 if np.any(steep & ahead) else 0
    return int(poses[last]) if ahead[last] else None


def record_of(rig: Rig, made: Design, seen: Seen, places: Sequence[Places], software: str) -> dict[str, Any]:
    """Plain numbers and names."""
    return {
        "schema": 1,
        "kind": "calibeam-design",
        "software": software,
        "rig": rig.name,
        "criterion": made.asked.criterion,
        "target": made.information.target,
        "candidates": len(made.candidates),
        "poses": len(made.taken.poses),
        "free_space_m": made.free_space_m,
        "random_free_space_m": made.random_m,
        "scale_sigma": made.scale_sigma,
        "hidden_m": made.information.hidden_m,
        "drift_absorbed": made.in_time.absorbed,
        "drift_absorbed_by_short_way": made.in_time.absorbed_before,
        "enough_poses": made.curve.enough,
        "curve": [
            {"poses": int(n), "chosen_m": float(a), "random_m": float(b)}
            for n, a, b in zip(made.curve.poses, made.curve.chosen_m, made.curve.random_m, strict=True)
        ],
        "places": [_place(one) for one in places],
        "smallest": [_name(one.name) | {"parameter": one.parameter, "value": one.value} for one in seen.smallest],
        "confusable": [{"one": _name(a), "other": _name(b), "r2": r2} for a, b, r2 in seen.confusable],
        "invisible": [_name(one) for one in seen.invisible],
        "isolability": {
            "terms": [f"{t.physics} at {t.port.where}" for t in seen.isolability.terms],
            "r2": seen.isolability.r2.tolist(),
        },
    }


def _place(one: Places) -> dict[str, Any]:
    return {
        "ids": list(one.ids),
        "free_space_m": one.free_space_m,
        "scale_sigma": one.scale_sigma,
        "with_distances_m": one.with_distances_m,
        "with_distances_scale_sigma": one.with_distances_scale,
        "distances_needed": one.distances_needed,
    }


def _name(one: Named) -> dict[str, Any]:
    return {
        "where": one.where,
        "depends_on": ",".join(one.depends_on),
        "shape": one.shape,
        "order": one.order,
        "physics": one.physics,
    }
