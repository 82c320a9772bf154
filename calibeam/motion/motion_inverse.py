"""The inverse kinematics of motion for what computes without it: corrections of commands, poses of a test cube."""

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.inverse.closed_form import closed_form
from acquisition.motion.inverse.solve import AtPose, all_solutions, refine
from calibrate.model.arms.rig_arm import RigArm

Floats = NDArray[np.float64]

SEED = 1  # of the starts of an arm without a closed form: the same poses always give the same commands


class MotionInverse:
    """The inverse kinematics of motion, with the closed form of the rig file's arm for its starts."""

    def __init__(self, drawn: RigArm) -> None:
        self._starts = closed_form(drawn)

    def solutions(self, arm: RigArm, T_base_flange: Floats, near_rad: Floats) -> Floats:
        return all_solutions(arm, T_base_flange, near_rad, self._starts, np.random.default_rng(SEED))

    def refined(self, arm: RigArm, T_base_flange: Floats, start_rad: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        solved = refine(arm, AtPose(T_base_flange), start_rad)
        return solved.q_rad, solved.found
