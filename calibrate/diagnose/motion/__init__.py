"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, with_torques

__all__ = ["TorqueDiagnosis", "diagnose_torques", "with_torques"]
