"""Pose tests of a robot after ISO 9283:1998: the test cube and its five poses, and what recordings of them show.

`cube` has the poses, `attained` brings samples of a device into the base beside what was commanded, `performance` has
the formulas: pose accuracy and repeatability, their variation by approach direction, distances, drift.
"""

from calibrate.iso9283.attained import EvaluatedTest, evaluate
from calibrate.iso9283.cube import CYCLE, CYCLES, FROM_THREE_SIDES, Plane, cube_corners_m, cube_poses_m
from calibrate.iso9283.performance import DistancePerformance, Performance, PosePerformance, PoseTest

__all__ = [
    "CYCLE",
    "CYCLES",
    "FROM_THREE_SIDES",
    "DistancePerformance",
    "EvaluatedTest",
    "Performance",
    "Plane",
    "PosePerformance",
    "PoseTest",
    "cube_corners_m",
    "cube_poses_m",
    "evaluate",
]
