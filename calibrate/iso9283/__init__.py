"""Pose tests of a robot after ISO 9283:1998: the test cube and its five poses, and what recordings of them show.

`cube` has the poses, `attained` brings samples of a device into the base beside what was commanded, `performance` has
the formulas: pose accuracy and repeatability, their variation by approach direction, distances, drift. Nothing is
imported here: who lists the packages of calibrate does not want to load the physics.
"""
