"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.link_prior import link_prior, torques_of_rig
from calibrate.diagnose.motion.links_alone import expected_nm, stated_drivers
from calibrate.diagnose.motion.motion_table import moments_in, planned_motion
from calibrate.diagnose.motion.to_model import model_of_motion, torques_of_model
from calibrate.diagnose.motion.torque_problem import LOOSE
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, with_torques
from calibrate.diagnose.motion.unseen_motion import (
    JointTorquesRecord,
    MotionReconciled,
    reconcile_motion,
)

__all__ = [
    "LOOSE",
    "JointTorquesRecord",
    "MotionReconciled",
    "TorqueDiagnosis",
    "diagnose_torques",
    "expected_nm",
    "link_prior",
    "model_of_motion",
    "moments_in",
    "planned_motion",
    "reconcile_motion",
    "stated_drivers",
    "torques_of_model",
    "torques_of_rig",
    "with_torques",
]
