"""Recorded motions with concealed torques: which arm, what is hidden in it, and what it records.

Open first `motion_case.draw_motion`; `driving` moves the arm of the world, `over_noise` weighs what is hidden
 against the noise.
"""
