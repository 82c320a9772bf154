"""The measuring arm as believed, for guidance: where the probe is, and postures that bring it somewhere."""

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.inverse.solve import AtPoint, refine, within
from calibrate.arms.rig_arm import RigArm

Floats = NDArray[np.float64]
ARRIVED_M = 1e-6  # far below what a person can do


class BelievedGuidedArm(RigArm):
    """Implements acquisition.guided.arm.GuidedArm."""

    def postures(self, start_rad: Floats, point_m: Floats) -> Floats:
        found = refine(self, AtPoint(self.point_m, point_m), start_rad, close=ARRIVED_M).q_rad
        return found[within(self, found)]
