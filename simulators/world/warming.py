"""Temperatures of a rig that warms up after power-on.

A body that is heated evenly and cooled by the air around it follows 1 - exp(-t/tau) (Newton's law of cooling). Nothing
in the emulated geometry depends on them: heat that lengthens a link is a mechanism (`simulators.defects`).
"""

import math

AMBIENT_DEGC = 22.0
JOINT_RISE_K = 12.0  # a UR5e at slow work reports about 30 to 35 degC in its joints after an hour
JOINT_TAU_S = 1800.0
PSD_RISE_K = 4.0  # a closed box with an amplifier; feels right
PSD_TAU_S = 900.0
LINK_SHARE = 0.45  # of what its motor warms to
LASER_RISE_K = 4.5
LASER_TAU_S = 600.0


def joint_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - JOINT_RISE_K * math.expm1(-time_s / JOINT_TAU_S)


def psd_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - PSD_RISE_K * math.expm1(-time_s / PSD_TAU_S)


def link_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC + LINK_SHARE * (joint_temperature_degC(time_s) - AMBIENT_DEGC)


def laser_temperature_degC(time_s: float) -> float:
    return AMBIENT_DEGC - LASER_RISE_K * math.expm1(-time_s / LASER_TAU_S)
