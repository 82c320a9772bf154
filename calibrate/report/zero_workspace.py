"""What the pictures of the workspace need, from the evidence of a dual-PSD session."""

import numpy as np

from calibrate.dual_psd_rig import dual_psd_chain
from calibrate.identification.evidence_record import EvidenceFields
from calibrate.parameters import start_values
from calibrate.report.evidence import Evidence
from calibrate.report.workspace.known_arm import KnownArm, limits_of, unpredicted
from calibrate.uncertainty.free_space import Scatter


def zero_arm(evidence: Evidence, proved: EvidenceFields | None) -> KnownArm | str:
    """The arm with its doubt, or why no error over the workspace can be told."""
    result, data, rig = evidence.result, evidence.data, evidence.recording.rig
    room = None if proved is None else proved["free_space"]
    why = unpredicted(room)
    if why is not None or room is None:
        return why or ""
    lower, upper = limits_of(rig)
    return KnownArm(
        dual_psd_chain(rig, data.placement, data.first_psd).model,
        result.parameters,
        start_values(result.parameters),
        result.theta,
        result.covariance,
        result.identifiability,
        Scatter(joint_rad=result.noise.joint_rad),
        np.array(room.point_m),
        lower,
        upper,
        data.q_rad,
    )
