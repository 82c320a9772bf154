"""What the pictures of the workspace need, from the evidence of a session of any instruments."""

import numpy as np

from calibrate.arms.rig_arm import limits_of
from calibrate.parameters import without_assumed
from calibrate.report.deleted import deleted_misfit
from calibrate.report.session_evidence import SessionEvidence
from calibrate.report.workspace.known_arm import KnownArm, scatter_of, unpredicted, whole_covariance
from calibrate.report.workspace.pictures import Measured
from calibrate.report.workspace.room import target_at
from calibrate.sensors.catalogue import names_with
from calibrate.sensors.kind import Trait
from calibrate.unseen_along import analyse_along

IN_SPACE = names_with(Trait.IN_SPACE)  # instruments that measure where the target is
NOT_IN_SPACE = (
    "No measured errors are drawn: no instrument of this session says where the target is; errors of the readings are "
    "in the next chapter."
)


def session_arm(evidence: SessionEvidence) -> KnownArm | str:
    """The arm with its doubt, or why no error over the workspace can be told."""
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
