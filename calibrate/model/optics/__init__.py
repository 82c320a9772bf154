"""A laser line on two detectors: the mount of the laser, mirror images of the faces, spots and their derivatives."""

from calibrate.model.optics.dual_psd import AXES, GAINS
from calibrate.model.optics.laser import CENTRED_M, LaserMount, Lines, distances, nearest_point

__all__ = ["AXES", "CENTRED_M", "GAINS", "LaserMount", "Lines", "distances", "nearest_point"]
