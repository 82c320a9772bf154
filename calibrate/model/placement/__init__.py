"""Where things stand: the device in the base, targets on the flange, points that several poses share."""

from calibrate.model.placement.device import AXES, Device
from calibrate.model.placement.target import TARGETS, UNKNOWN_PLAUSIBLE_M, Target, point_by_twist

__all__ = ["AXES", "TARGETS", "UNKNOWN_PLAUSIBLE_M", "Device", "Target", "point_by_twist"]
