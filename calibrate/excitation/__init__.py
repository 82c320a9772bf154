"""Motions that show the torques of all joints, and what a motion would show of them."""

from calibrate.excitation.catalogue_sigmas import torque_information
from calibrate.excitation.fourier import Excitation, ExcitationWish, excite

__all__ = [
    "Excitation",
    "ExcitationWish",
    "excite",
    "torque_information",
]
