"""A measuring arm that a person moves: its true structure, its encoders, and the hand that holds the probe.

Open `world.HandWorld` first; a new deviation is a field in `rig`, a draw in `truth` and a term in `arm`.
"""
