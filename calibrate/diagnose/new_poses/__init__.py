"""Poses that would decide between explanations that the measured ones leave open, as a plan for the next session."""

from calibrate.diagnose.new_poses.contests import separating
from calibrate.diagnose.new_poses.plan_of import plan_of, short_way

__all__ = ["plan_of", "separating", "short_way"]
