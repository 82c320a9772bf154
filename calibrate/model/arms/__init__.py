"""Arm models: D-H, modified D-H, product of exponentials; one file a notation, one forward kinematics for all."""
