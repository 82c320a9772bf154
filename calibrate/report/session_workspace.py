"""What the pictures of the workspace need, from the evidence of a session of any instruments.

What each observation is missed by when the fit is made without it, without fitting again.
With whitened residual r and derivative J of one observation and the posterior covariance C of the parameters,
r / (1 - J C J') is its error in the fit of all others: exact for a linear model, to first order for this one.
Source: Cook, Weisberg, Residuals and Influence in Regression, 1982, ch. 2.2 and, for several rows at once, ch. 3.6.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.arms.rig_arm import limits_of
from calibrate.joint_problem import JointProblem
from calibrate.parameters import without_assumed
from calibrate.problem import Problem
from calibrate.report.session_evidence import SessionEvidence
from calibrate.report.workspace.known_arm import KnownArm, scatter_of, unpredicted, whole_covariance
from calibrate.report.workspace.pictures import Measured
from calibrate.report.workspace.room import Room, room_of, target_at
from calibrate.sensors.catalogue import names_with
from calibrate.sensors.kind import Trait
from calibrate.unseen_along import analyse_along

IN_SPACE = names_with(Trait.IN_SPACE)  # instruments that measure where the target is
NOT_IN_SPACE = (
    "No measured errors are drawn: no instrument of this session measures where the target is; errors of the "
    "readings are "
    "in the next chapter."
)

Floats = NDArray[np.float64]

ALONE = 1e-6  # of 1 - J C J': below, the observation alone determines something, and nothing else predicts it


def session_arm(evidence: SessionEvidence) -> KnownArm | str:
    """The arm with its doubt, or why no error over the workspace can be determined."""
    problem, model, theta = evidence.problem, evidence.model, evidence.theta
    why = unpredicted(model.free_space)
    if why is not None or model.free_space is None:
        return why or ""
    lower, upper = limits_of(evidence.recording.rig)
    return KnownArm(
        evidence.arm,
        problem.parameters,
        evidence.drawn,
        theta,
        whole_covariance(model.covariance, problem.parameters),
        analyse_along(problem.fulfilled(theta), theta, without_assumed(problem.parameters)),
        scatter_of(model.noise),
        np.array(model.free_space.point_m),
        lower,
        upper,
        evidence.q_rad,
    )


def session_room(evidence: SessionEvidence) -> Room | str:
    """Errors of the tool over the workspace, or why none can be determined. About half a second."""
    known = session_arm(evidence)
    return known if isinstance(known, str) else room_of(known)


def session_measured(evidence: SessionEvidence, known: KnownArm) -> Measured | None:
    """Errors at the poses, each predicted from all others; None where no instrument says where the target is."""
    for index, name in enumerate(evidence.model.instruments):
        readings = next((r for r in evidence.readings if r.instrument == name and r.unit == "m"), None)
        if name not in IN_SPACE or readings is None:
            continue
        left = deleted_misfit(evidence.problem, index, known.theta, known.covariance)
        if left is None:
            continue
        found = np.linalg.norm(left[:, :3], axis=1)
        told = np.isfinite(found)
        points = target_at(known, known.theta, evidence.recording.samples.joints()[readings.rows[:, 0]])
        return Measured(points[told], readings.error_before[told], found[told])
    return None


def deleted_misfit(problem: JointProblem, index: int, theta: Floats, covariance: Floats) -> Floats | None:
    """(obs, k) misfit of block `index`, in the sensor's unit, each observation left out in turn; NaN where ALONE.

    None for a block whose rows are not readings of their own. `covariance` (param, param) is under the weights of
    `problem`.
    """
    block = problem.blocks[index]
    if not isinstance(block, Problem) or block.correlation is not None or block.condition:
        return None
    shape = block.observed.shape
    J = problem.jacobian_of(index, theta).reshape(*shape, len(theta))
    rest = np.eye(shape[1]) - np.einsum("nip,pq,njq->nij", J, covariance, J, optimize=True)
    told = np.linalg.eigvalsh(rest)[:, 0] > ALONE
    out = np.full(shape, np.nan)
    residual = problem.residual_of(index, theta).reshape(shape)[told]
    whitened = np.linalg.solve(rest[told], residual[..., None])
    out[told] = np.linalg.solve(block.whitener[told], whitened)[..., 0]
    return out
