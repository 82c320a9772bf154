"""A design: poses chosen from candidates, how many are enough, their order, and the plan that a session runs."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from acquisition.recording.pose_plan import PosePlan
from acquisition.recording.rig import Rig
from calibrate.errors import DataError
from calibrate.pose_design.candidates import Candidates
from calibrate.pose_design.criteria import CRITERIA
from calibrate.pose_design.exchange import Choice, choose, one_by_one
from calibrate.pose_design.information import Information
from calibrate.pose_design.order import Ordered, ordered
from calibrate.pose_design.plan_of import Taken, blocks_of, plan_of, taken

Floats = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

STARTS = ("d", "o3")  # criteria whose choices are further starts: cheap, and they spread poses
DRAWN = 20  # random choices to compare with
LONGEST = 2.5  # of the asked-for number: how far the curve is drawn
ENOUGH = 0.75  # of -d ln error / d ln poses: below, more poses do little but average noise, for which it is 0.5

AHEAD = 1.5  # times as many poses, between which the steepness is taken


@dataclass(frozen=True)
class Asked:
    """How a plan is to be."""

    poses: int = 60  # readings, repeats among them
    repeats: int = 6
    criterion: str = "free-space"
    seed: int = 1


@dataclass(frozen=True)
class Curve:
    """Predicted error over the workspace by number of poses, m: chosen one by one, and drawn at random (median)."""

    poses: NDArray[np.intp]
    chosen_m: Floats
    random_m: Floats
    enough: int | None  # from here on more poses do little but average noise; None: not within the curve


@dataclass(frozen=True)
class Design:
    """A plan and what it promises. Lengths are rms of the target over the workspace, three axes together."""

    asked: Asked
    candidates: Candidates
    information: Information
    choice: Choice
    in_time: Ordered
    taken: Taken
    plan: PosePlan
    curve: Curve
    free_space_m: float
    random_m: float  # as many poses drawn from the candidates, median
    scale_sigma: float


def design(
    rig: Rig,
    candidates: Candidates,
    found: Information,
    asked: Asked,
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


def _check(rig: Rig, candidates: Candidates, asked: Asked) -> None:
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


def _curve(found: Information, asked: Asked, rng: np.random.Generator) -> Curve:
    """One by one by the determinant, whatever the criterion: one list for all numbers."""
    total = len(found.rows)
    most = min(total, max(20, round(LONGEST * asked.poses)))
    chosen, _ = one_by_one(CRITERIA["d"](found), most, total)
    at = np.unique(np.linspace(max(4, most // 30), most, 30).astype(np.intp))
    error = np.array([found.free_space_m(found.of(np.array(chosen[:n]))) for n in at])
    drawn = np.array([_random_m(found, int(n), rng) for n in at])
    return Curve(at, error, drawn, enough_of(at, error))


def enough_of(poses: NDArray[np.intp], error_m: Floats) -> int | None:
    """The number behind the last one from which half as many more make it steeper than ENOUGH; a choice has steps."""
    more = np.interp(np.log(AHEAD * poses), np.log(poses), np.log(error_m))
    steep = (np.log(error_m) - more) / np.log(AHEAD) > ENOUGH
    told = AHEAD * poses <= poses[-1]
    last = int(np.flatnonzero(steep & told)[-1]) + 1 if np.any(steep & told) else 0
    return int(poses[last]) if told[last] else None
