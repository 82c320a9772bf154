"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.links_alone import expected_nm
from calibrate.diagnose.motion.to_model import model_of_motion, torques_of_model
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, with_torques

__all__ = [
    "TorqueDiagnosis",
    "diagnose_torques",
    "expected_nm",
    "model_of_motion",
    "torques_of_model",
    "with_torques",
]
