"""Rows that a fit has not seen: how they are chosen, what is predicted of them, and the bootstrap."""

from calibrate.fit.held_out.held_out import Proof, beyond_sigma, held_out
from calibrate.fit.held_out.splits import CLOSE_RAD, Split, by_place, last_block, same_poses

__all__ = ["CLOSE_RAD", "Proof", "Split", "beyond_sigma", "by_place", "held_out", "last_block", "same_poses"]
