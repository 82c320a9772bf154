"""The proof by rows that the fit has not seen, for each instrument in its own unit and for each way to split."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.samples import SEAT, SPOTS
from calibrate.fit.held_out.held_out import HeldOut, Proof, held_out
from calibrate.fit.held_out.splits import (
    Split,
    SplitKind,
    same_poses,
    usual,
)
from calibrate.fit.identify.result import Proven, Unseen
from calibrate.fit.identify.rounds import Fitted
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.solvers import Fit
from calibrate.model.problem import Problem

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = NDArray[np.intp]

POSE = 6  # x, y, z (m), then a turn (rad), which does not add to a length
FEWEST_POSES = 15  # below, a fifth held out is two poses and the proof is luck


@dataclass(frozen=True)
class Splitting:
    """What is left out in turn: `share` of the rows (0: nothing at all) by these kinds of split."""

    share: float = 0.2
    kinds: tuple[SplitKind, ...] = tuple(SplitKind)


def proof(fitted: Fitted, before: Fit, splits: tuple[Split, ...]) -> Proven:
    """Both fits predict unseen rows of the joint problem; `before`: the arm held nominal, for the error before."""
    after, drawn = (fitted.problem.with_parameters(fit.parameters) for fit in (fitted.fit, before))
    found: list[Unseen] = []
    unproven: list[str] = []
    for split in splits:
        old = held_out(drawn, split, before.theta, _lengths_of_all, fitted.by)
        new = held_out(after, split, fitted.fit.theta, _lengths_of_all, fitted.by)
        failed = next((one.proof for one in (new, old) if one.proof is not Proof.DONE), None)
        if failed is None:
            found += _by_instrument(fitted, split, old, new)
        else:
            unproven.append(f"{split.says}: {failed.value}")
    return Proven(tuple(found), tuple(unproven))


def splits_of(fitted: Fitted, samples: Samples, splitting: Splitting, rng: Generator) -> tuple[Split, ...]:
    """Splits of the joint problem by rows of these samples: unseen is every observation that an unseen row is part of.

    So no row is on both sides. None with too few poses. A known length goes with what only unseen rows know.
    """
    measured = fitted.weighting.measured
    rows = np.unique(np.concatenate([m.sample_rows.ravel() for m in measured]))
    pose = same_poses(samples.joints()[rows])
    if pose.max(initial=-1) + 1 < FEWEST_POSES or splitting.share == 0.0:
        return ()
    place, t_s = places_of(samples)[rows], samples.column("t_s")[rows]
    by_sample = usual(len(rows), rng, place=place, t_s=t_s, pose=pose, share=splitting.share, kinds=splitting.kinds)
    out: list[Split] = []
    for split in by_sample:
        folds = [
            np.flatnonzero(np.concatenate([np.isin(m.sample_rows, rows[fold]).any(axis=1) for m in measured]))
            for fold in split.unseen
        ]
        out.append(Split(split.says, tuple(_with_known_lengths(fitted, fold) for fold in folds)))
    return tuple(out)


def places_of(samples: Samples) -> Ints:
    """(row,) which place each row speaks of: a placement of the fixture or a seat, each a number; -1 for none."""
    place = np.full(len(samples), -1, dtype=np.int64)
    if SPOTS[0] in samples:
        lit = np.isfinite(samples.column(SPOTS[0]))
        place[lit] = samples.integers("placement", -1)[lit]
    seat = samples.integers(SEAT, -1)
    seated = (place < 0) & (seat >= 0)
    place[seated] = seat[seated] + place.max(initial=0) + 1
    return place


def lengths(problem: JointProblem, index: int, theta: Floats) -> Floats:
    """(row,) length of one instrument's misfit, m, for values (param,) of the whole fit; of a pose its position's."""
    block, own = problem.blocks[index], problem.of_block(index, theta)
    if block.rows == 0:
        return np.zeros(0)
    misfit = block.misfit(own) if isinstance(block, Problem) else block.residual(own).reshape(block.rows, -1)
    of_joints = isinstance(block, Problem) and block.chain.sensor.joints_compared()
    return np.linalg.norm(misfit[:, :3] if misfit.shape[1] == POSE and not of_joints else misfit, axis=1)


def _lengths_of_all(problem: JointProblem, theta: Floats) -> Floats:
    return np.concatenate([lengths(problem, i, theta) for i in range(len(problem.blocks))])


def _with_known_lengths(fitted: Fitted, unseen: Rows) -> Rows:
    """Unseen rows of the joint problem, with the known lengths between places that no row left speaks of."""
    problem, theta = fitted.problem, fitted.fit.theta
    known = np.arange(sum(m.problem.rows for m in fitted.weighting.measured), problem.rows)
    if len(known) == 0:
        return unseen
    used = np.setdiff1d(np.arange(known[0]), unseen)
    silent = ~np.any(problem.select(used).jacobian(theta), axis=0)
    theirs = problem.select(known).jacobian(theta)
    return np.concatenate([unseen, known[np.any(theirs[:, silent], axis=1)]])


def _by_instrument(fitted: Fitted, split: Split, old: HeldOut, new: HeldOut) -> list[Unseen]:
    rows = np.concatenate(split.unseen)
    before, after = np.concatenate(old.errors), np.concatenate(new.errors)
    out: list[Unseen] = []
    for measured, first in zip(fitted.weighting.measured, fitted.problem.first_rows, strict=False):
        own = (rows >= first) & (rows < first + measured.problem.rows)
        if own.any() and new.chi is not None and new.chi_predicted is not None:
            rms = [float(np.sqrt(np.mean(errors[own] ** 2))) for errors in (before, after)]
            out.append(Unseen(measured.name, split.says, int(own.sum()), rms[0], rms[1], new.chi, new.chi_predicted))
    return out
