"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.link_prior import torques_of_rig
from calibrate.diagnose.motion.links_alone import expected_nm
from calibrate.diagnose.motion.to_model import model_of_motion, torques_of_model
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, with_torques
from calibrate.diagnose.motion.unseen_motion import (
    JointTorquesRecord,
    MotionReconciled,
    motion_in_two,
    reconcile_motion,
)

__all__ = [
    "JointTorquesRecord",
    "MotionReconciled",
    "TorqueDiagnosis",
    "diagnose_torques",
    "expected_nm",
    "model_of_motion",
    "motion_in_two",
    "reconcile_motion",
    "torques_of_model",
    "torques_of_rig",
    "with_torques",
]
