"""A measuring arm that a person moves: its true structure, its encoders, and the hand that holds the probe.

Open `world.HandWorld` first; a new deviation is a field and a draw in `hand_rig`, and a term in `held_arm`.
"""
