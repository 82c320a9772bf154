"""Torques of a joint that no catalogue lists: a diagnosis may place them, but has no name for them.

Each is a plausible fault of a drive or of what is fastened to it.
"""

from dataclasses import dataclass

import numpy as np

from simulators.defects.defect import Floats, Shafts
from simulators.defects.torque import Size, TorqueDefect, sense


@dataclass(frozen=True)
class BentSeal(TorqueDefect):
    """Friction that rises and falls over a turn of the joint: A (1 + sin(2 q + phase)) / 2 against the motion."""

    friction_nm: Size
    phase_rad: float

    KIND = "outside-bent-seal"
    PHYSICS = "unknown"
    DRIVERS = ("qd{joint}", "q{joint}")
    SIZE = "friction_nm"

    def joint_friction_nm(self, shafts: Shafts) -> Floats:
        here = self.joint - 1
        wave = 0.5 + 0.5 * float(np.sin(2.0 * float(shafts.q_rad[here]) + self.phase_rad))
        return self.at_joint(self.friction_nm * wave * sense(float(shafts.qd_rad_s[here])), len(shafts.q_rad))


@dataclass(frozen=True)
class ShortHose(TorqueDefect):
    """A hose that pulls from `taut_rad` on only: k (q - taut)."""

    stiffness_nm_rad: Size
    taut_rad: float

    KIND = "outside-short-hose"
    PHYSICS = "unknown"
    DRIVERS = ("q{joint}",)
    SIZE = "stiffness_nm_rad"

    def joint_pull_nm(self, shafts: Shafts) -> Floats:
        over_rad = max(float(shafts.q_rad[self.joint - 1]) - self.taut_rad, 0.0)
        return self.at_joint(self.stiffness_nm_rad * over_rad, len(shafts.q_rad))


@dataclass(frozen=True)
class WornOutputWheel(TorqueDefect):
    """A wheel on the joint's own side: A sin(5 q + phase), which is no order of the motor."""

    torque_nm: Size
    phase_rad: float

    KIND = "outside-worn-output-wheel"
    PHYSICS = "unknown"
    DRIVERS = ("q{joint}",)
    SIZE = "torque_nm"

    def joint_pull_nm(self, shafts: Shafts) -> Floats:
        turned_rad = 5.0 * float(shafts.q_rad[self.joint - 1]) + self.phase_rad
        return self.at_joint(self.torque_nm * float(np.sin(turned_rad)), len(shafts.q_rad))
