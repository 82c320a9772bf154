"""A recording in motion: what its joints' torques hold beside rigid links."""

from calibrate.diagnose.motion.motion_table import BAND_HZ, MOST_ROWS, STILL_SHARE, Motion
from calibrate.diagnose.motion.repeats import MOTION_EVENT, RepeatScatter, scatter_of_repeats
from calibrate.diagnose.motion.torque_problem import LOOSE, link_parameters
from calibrate.diagnose.motion.torques import TorqueDiagnosis, diagnose_torques, motion_drivers, with_torques

__all__ = [
    "BAND_HZ",
    "LOOSE",
    "MOST_ROWS",
    "MOTION_EVENT",
    "STILL_SHARE",
    "Motion",
    "RepeatScatter",
    "TorqueDiagnosis",
    "diagnose_torques",
    "link_parameters",
    "motion_drivers",
    "scatter_of_repeats",
    "with_torques",
]
