"""What travels with an identification beside its values: unseen rows, observability, error over the workspace.

Proofs are by rows that the fit has not seen, for each instrument in its own unit and for each way to split.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from acquisition.recording.samples import SEAT, SPOTS
from calibrate.fit.accuracy import PoseScatter, Workspace, free_space_error
from calibrate.fit.held_out.held_out import Bootstrap, HeldOutRows, Proof, bootstrap, held_out
from calibrate.fit.held_out.splits import (
    Split,
    SplitKind,
    same_poses,
    usual,
)
from calibrate.fit.identify.result import (
    Evidence,
    FreeSpace,
    HeldOutError,
    Noise,
    Proven,
)
from calibrate.fit.identify.rounds import SettledFit
from calibrate.fit.identify.session import about_of
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.rank.observability import Observability, observability, reduced
from calibrate.fit.solvers import Fit, Status
from calibrate.fit.weighting import JOINT
from calibrate.model.problem import Problem
from calibrate.model.sensors.catalogue import LENGTHS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Rows = NDArray[np.intp]
POSE = 6  # x, y, z (m), then a turn (rad), which does not add to a length
FEWEST_POSES = 15  # below, a fifth held out is two poses and the proof is luck
OF_JOINTS = "the scatter of the joint readings"
OF_INSTRUMENT = "the scatter of the instrument's readings, which cannot be separated from that of the arm's"
FLANGE = (0.0, 0.0, 0.0)  # stands for the target where nobody names one


@dataclass(frozen=True)
class Splitting:
    """What is left out in turn: `share` of the rows (0: nothing at all) by these kinds of split."""

    share: float = 0.2
    kinds: tuple[SplitKind, ...] = tuple(SplitKind)


def proof(fitted: SettledFit, before: Fit, splits: tuple[Split, ...]) -> Proven:
    """Both fits predict unseen rows of the joint problem; `before`: the arm held nominal, for the error before."""
    after, drawn = (fitted.problem.with_parameters(fit.parameters) for fit in (fitted.fit, before))
    found: list[HeldOutError] = []
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


def splits_of(fitted: SettledFit, samples: Samples, splitting: Splitting, rng: Generator) -> tuple[Split, ...]:
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


def _with_known_lengths(fitted: SettledFit, unseen: Rows) -> Rows:
    """Unseen rows of the joint problem, with the known lengths between places that no row left speaks of."""
    problem, theta = fitted.problem, fitted.fit.theta
    known = np.arange(sum(m.problem.rows for m in fitted.weighting.measured), problem.rows)
    if len(known) == 0:
        return unseen
    used = np.setdiff1d(np.arange(known[0]), unseen)
    silent = ~np.any(problem.select(used).jacobian(theta), axis=0)
    theirs = problem.select(known).jacobian(theta)
    return np.concatenate([unseen, known[np.any(theirs[:, silent], axis=1)]])


def _by_instrument(fitted: SettledFit, split: Split, old: HeldOutRows, new: HeldOutRows) -> list[HeldOutError]:
    rows = np.concatenate(split.unseen)
    before, after = np.concatenate(old.errors), np.concatenate(new.errors)
    out: list[HeldOutError] = []
    for measured, first in zip(fitted.weighting.measured, fitted.problem.first_rows, strict=False):
        own = (rows >= first) & (rows < first + measured.problem.rows)
        if own.any() and new.chi is not None and new.chi_predicted is not None:
            rms = [float(np.sqrt(np.mean(errors[own] ** 2))) for errors in (before, after)]
            out.append(
                HeldOutError(measured.name, split.says, int(own.sum()), rms[0], rms[1], new.chi, new.chi_predicted)
            )
    return out


@dataclass(frozen=True)
class EvidenceOptions:
    """How thorough the proofs are to be; the defaults are what every result gets."""

    splitting: Splitting = field(default_factory=Splitting)
    bootstrap_rounds: int = 0


def evidence_of(
    fitted: SettledFit,
    seen: Identifiability,
    before: Fit,
    noise: tuple[Noise, ...],
    rig: Rig,
    samples: Samples,
    asked: EvidenceOptions,
    rng: Generator,
) -> Evidence:
    """All proofs of a fit. `seen`: at its end; `before`: the nominal arm; `samples`: the whole file."""
    if fitted.fit.status is Status.NOT_FINITE:
        return Evidence(Proven(), None, None, None)
    return Evidence(
        proof(fitted, before, splits_of(fitted, samples, asked.splitting, rng)),
        observability_of(fitted.problem, fitted.fit.theta, len(rows_used(fitted))),
        free_space_of(fitted, seen, noise, rig, rng),
        _bootstrap(fitted, asked.bootstrap_rounds, rng),
    )


def rows_used(fitted: SettledFit) -> NDArray[np.intp]:
    """Rows of the samples that took part, sorted."""
    return np.unique(np.concatenate([m.sample_rows.ravel() for m in fitted.weighting.measured]))


def observability_of(problem: JointProblem, theta: Floats, poses: int) -> Observability:
    """Of what the data alone can show: priors aside, one parameter of every combination that they do not see held."""
    bare = tuple(replace(p, prior=np.inf) for p in problem.parameters)
    jacobian = problem.jacobian(theta)
    return observability(jacobian, reduced(bare, analyse(jacobian, bare)), poses)


def free_space_of(
    fitted: SettledFit, seen: Identifiability, noise: tuple[Noise, ...], rig: Rig, rng: Generator
) -> FreeSpace:
    """Over poses drawn evenly between the joint limits: the sigma of the parameters, and a single pose's with it."""
    lower, upper = (np.array([getattr(j, k) for j in rig.arm.joints]) for k in ("lower_rad", "upper_rad"))
    x, y, z = about_of(fitted.weighting).get("tool", rig.tool.point_m or FLANGE)[:3]
    room = Workspace(lower, upper, np.array([x, y, z]))
    model = fitted.weighting.measured[0].problem.chain.model
    scatter, says = _scatter(noise)
    poses = rng.integers(2**31)  # the same ones for both
    each = [
        free_space_error(model, fitted.fit, seen, room, np.random.default_rng(poses), s)
        for s in (PoseScatter(), scatter)
    ]
    return FreeSpace(each[0], each[1], scatter, says, room.poses, (x, y, z))


def _scatter(noise: tuple[Noise, ...]) -> tuple[PoseScatter, str]:
    found = {n.source: n.found for n in noise}
    if JOINT in found:
        return PoseScatter(joint_rad=found[JOINT]), OF_JOINTS
    return PoseScatter(target_m=max(found.get(source, 0.0) for source in LENGTHS)), OF_INSTRUMENT


def _bootstrap(fitted: SettledFit, rounds: int, rng: Generator) -> Bootstrap | None:
    """Observations of one row of the samples are drawn together; known lengths are stated and stay."""
    if rounds == 0:
        return None
    group = np.full(fitted.problem.rows, -1, dtype=np.int64)
    for measured, first in zip(fitted.weighting.measured, fitted.problem.first_rows, strict=False):
        group[first : first + measured.problem.rows] = measured.sample_rows[:, 0]
    problem = fitted.problem.with_parameters(fitted.fit.parameters)
    return bootstrap(problem, fitted.fit, rng, rounds=rounds, group=group, by=fitted.by)
