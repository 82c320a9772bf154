"""Motions that show the torques of all joints, and what a motion would show of them."""

from calibrate.excitation.catalogue_sigmas import LEAST_SHARE, NOISE_SHARE, ROTOR, torque_information
from calibrate.excitation.fourier import Excitation, ExcitationWish, excite

__all__ = [
    "LEAST_SHARE",
    "NOISE_SHARE",
    "ROTOR",
    "Excitation",
    "ExcitationWish",
    "excite",
    "torque_information",
]
