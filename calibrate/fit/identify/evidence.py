"""What travels with an identification beside its values: proofs on unseen rows, observability, error over the
workspace.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording import Samples
from acquisition.recording.rig import Rig
from calibrate.fit.accuracy.free_space import Scatter, Workspace, free_space_error
from calibrate.fit.held_out.held_out import Bootstrap, bootstrap
from calibrate.fit.identify.result import (
    Evidence,
    FreeSpace,
    Noise,
    Proven,
)
from calibrate.fit.identify.rounds import Fitted
from calibrate.fit.identify.session import about_of
from calibrate.fit.identify.unseen_rows import Splitting, proof, splits_of
from calibrate.fit.joint_problem import JointProblem
from calibrate.fit.rank.identifiability import Identifiability, analyse
from calibrate.fit.rank.observability import Observability, observability
from calibrate.fit.rank.redundant import reduced
from calibrate.fit.solvers import Fit, Status
from calibrate.fit.weighting import JOINT
from calibrate.model.sensors.catalogue import LENGTHS

Floats = NDArray[np.float64]

OF_JOINTS = "the scatter of the joint readings"
OF_INSTRUMENT = "the scatter of the instrument's readings, which cannot be separated from that of the arm's"
FLANGE = (0.0, 0.0, 0.0)  # stands for the target where nobody names one


@dataclass(frozen=True)
class Asked:
    """How thorough the proofs are to be; the defaults are what every result gets."""

    splitting: Splitting = field(default_factory=Splitting)
    bootstrap_rounds: int = 0


def evidence_of(
    fitted: Fitted,
    seen: Identifiability,
    before: Fit,
    noise: tuple[Noise, ...],
    rig: Rig,
    samples: Samples,
    asked: Asked,
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


def rows_used(fitted: Fitted) -> NDArray[np.intp]:
    """Rows of the samples that took part, sorted."""
    return np.unique(np.concatenate([m.sample_rows.ravel() for m in fitted.weighting.measured]))


def observability_of(problem: JointProblem, theta: Floats, poses: int) -> Observability:
    """Of what the data alone can show: priors aside, one parameter of every combination that they do not see held."""
    bare = tuple(replace(p, prior=np.inf) for p in problem.parameters)
    jacobian = problem.jacobian(theta)
    return observability(jacobian, reduced(bare, analyse(jacobian, bare)), poses)


def free_space_of(
    fitted: Fitted, seen: Identifiability, noise: tuple[Noise, ...], rig: Rig, rng: Generator
) -> FreeSpace:
    """Over poses drawn evenly between the joint limits: the sigma of the parameters, and a single pose's with it."""
    lower, upper = (np.array([getattr(j, k) for j in rig.arm.joints]) for k in ("lower_rad", "upper_rad"))
    x, y, z = about_of(fitted.weighting).get("tool", rig.tool.point_m or FLANGE)[:3]
    room = Workspace(lower, upper, np.array([x, y, z]))
    model = fitted.weighting.measured[0].problem.chain.model
    scatter, says = _scatter(noise)
    poses = rng.integers(2**31)  # the same ones for both
    each = [
        free_space_error(model, fitted.fit, seen, room, np.random.default_rng(poses), s) for s in (Scatter(), scatter)
    ]
    return FreeSpace(each[0], each[1], scatter, says, room.poses, (x, y, z))


def _scatter(noise: tuple[Noise, ...]) -> tuple[Scatter, str]:
    found = {n.source: n.found for n in noise}
    if JOINT in found:
        return Scatter(joint_rad=found[JOINT]), OF_JOINTS
    return Scatter(target_m=max(found.get(source, 0.0) for source in LENGTHS)), OF_INSTRUMENT


def _bootstrap(fitted: Fitted, rounds: int, rng: Generator) -> Bootstrap | None:
    """Observations of one row of the samples are drawn together; known lengths are stated and stay."""
    if rounds == 0:
        return None
    group = np.full(fitted.problem.rows, -1, dtype=np.int64)
    for measured, first in zip(fitted.weighting.measured, fitted.problem.first_rows, strict=False):
        group[first : first + measured.problem.rows] = measured.sample_rows[:, 0]
    problem = fitted.problem.with_parameters(fitted.fit.parameters)
    return bootstrap(problem, fitted.fit, rng, rounds=rounds, group=group, by=fitted.by)
