"""Rows that a fit has not seen: how they are chosen, what is predicted of them, and the bootstrap."""

from calibrate.fit.held_out.held_out import beyond_sigma
from calibrate.fit.held_out.splits import CLOSE_RAD, Split, by_place, last_block, same_poses

__all__ = ["CLOSE_RAD", "Split", "beyond_sigma", "by_place", "last_block", "same_poses"]
