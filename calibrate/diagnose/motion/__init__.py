"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.link_prior import link_prior, torques_of_rig
from calibrate.diagnose.motion.links_alone import expected_nm, planned_drivers
from calibrate.diagnose.motion.motion_table import moments_in
from calibrate.diagnose.motion.repeats import scatter_of_repeats
from calibrate.diagnose.motion.to_model import model_of_motion, torques_of_model
from calibrate.diagnose.motion.torque_problem import LOOSE
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, with_torques
from calibrate.diagnose.motion.unseen_motion import JointTorquesRecord, MotionReconciled, reconcile_motion

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
    "planned_drivers",
    "reconcile_motion",
    "scatter_of_repeats",
    "torques_of_model",
    "torques_of_rig",
    "with_torques",
]
