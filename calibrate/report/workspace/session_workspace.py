"""The chapter on the error over the workspace, from the evidence of a session of any instruments.

The error of each observation in a fit without it is computed without fitting again. With whitened residual r and
derivative J of one observation and the posterior covariance C of the parameters, r / (1 - J C J') is its error in the
fit of all others: exact for a linear model, to first order for this one. Source: Cook, Weisberg, Residuals and
Influence in Regression, 1982, ch. 2.2 and, for several rows at once, ch. 3.6.
"""

import numpy as np
from numpy.typing import NDArray

from calibrate.fit.joint_problem import JointProblem
from calibrate.model.problem import Problem
from calibrate.model.sensors.catalogue import names_with
from calibrate.model.sensors.kind import Trait
from calibrate.report.elements.html import (
    Html,
    figure,
    section,
    tag,
)
from calibrate.report.evidence.session_evidence import SessionEvidence
from calibrate.report.workspace.pictures import MeasuredErrors, before_and_after
from calibrate.report.workspace.workspace_errors import KnownArm, Room, target_at

IN_SPACE = names_with(Trait.IN_SPACE)  # instruments that measure where the target is
NOT_IN_SPACE = (
    "No measured errors are drawn: no instrument of this session measures where the target is; errors of the "
    "readings are "
    "in the next chapter."
)

Floats = NDArray[np.float64]

ALONE = 1e-6  # of 1 - J C J': below, the observation alone determines something, and nothing else predicts it


def session_measured(evidence: SessionEvidence, known: KnownArm) -> MeasuredErrors | None:
    """Errors at the poses, each predicted from all others; None where no instrument shows where the target is."""
    for index, name in enumerate(evidence.model.instruments):
        readings = next((r for r in evidence.readings if r.instrument == name and r.unit == "m"), None)
        if name not in IN_SPACE or readings is None:
            continue
        left = deleted_misfit(evidence.problem, index, known.theta, known.covariance)
        if left is None:
            continue
        found = np.linalg.norm(left[:, :3], axis=1)
        finite = np.isfinite(found)
        points = target_at(known, known.theta, evidence.recording.samples.joints()[readings.rows[:, 0]])
        return MeasuredErrors(points[finite], readings.error_before[finite], found[finite])
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
    determined = np.linalg.eigvalsh(rest)[:, 0] > ALONE
    out = np.full(shape, np.nan)
    residual = problem.residual_of(index, theta).reshape(shape)[determined]
    whitened = np.linalg.solve(rest[determined], residual[..., None])
    out[determined] = np.linalg.solve(block.whitener[determined], whitened)[..., 0]
    return out


WORKSPACE_TITLE = "Error over the workspace"
LEAD = "How far the tool is from where the controller thinks it is, wherever the arm can go."


def workspace(room: Room | str, measured: MeasuredErrors | None, why_not_measured: str) -> Html:
    """Pictures; or why there are none. `why_not_measured` is printed where `measured` is None."""
    if isinstance(room, str):
        return section("workspace", WORKSPACE_TITLE, LEAD, tag("p", f"Not drawn: {room}."))
    share = float(room.supported.mean())
    caption = (
        "Left from the side, all directions together (radius: from the base's z axis); right from above, all heights "
        "together. Darker is worse: rms over the poses that bring the target there, one scale for all pictures. "
        "Hatched: reached only with a joint beyond the angles of the session, or by extrapolation from its poses. "
        "Predicted: one sigma, from the covariance of the fit and the scatter of a single pose, if the model is "
        "complete; where base and device stand is left out."
    )
    explained = (
        "Measured: distance of each reading from what is expected; for the calibrated arm each pose is predicted from "
        "all other poses. Where measured is worse than predicted, the model lacks something there."
        if measured is not None
        else why_not_measured
    )
    pictures = tag("div", figure(before_and_after(room, measured), f"{caption} {explained}"), cls="wide")
    within = f"Of the poses between the joint angles of the session, {share:.0%} are covered by the calibration poses."
    return section("workspace", WORKSPACE_TITLE, LEAD, pictures, tag("p", within))
