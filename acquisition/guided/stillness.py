"""When a reading may be taken: the probe stays where it is, though the hand trembles. Across a slip it does not.

A ball in a seat stays while the joints go round it, so it is the probe's place that is judged. The believed arm serves
well enough: geometry that is off by 1e-3 shows a tremble of a milliradian as a micrometre.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.arm import GuidedArm
from acquisition.guided.window import Window

Floats = NDArray[np.float64]
PARTS = 4  # that a dwell is cut into; a slip shows between their means


class ArmMotion(Enum):
    """What a window shows."""

    SHORT = "too few samples yet"
    MOVING = "moving"
    STILL = "still"


@dataclass(frozen=True)
class StillRule:
    """Over `dwell_s` the probe stays within `place_m`, or within `sigmas` of what its samples scatter."""

    dwell_s: float = 0.5
    least: int = 8  # samples
    place_m: float = 15e-6  # beyond what a reading's noise gives at 1 m; a ball on the rim is off by ten times that
    sigmas: float = 6.0
    joint_rad: float = (
        0.01  # swing of a joint: beyond, the probe's place at the mean angle is not its mean place: 10 um
    )

    def judge(self, arm: GuidedArm, window: Window) -> ArmMotion:
        """Of the last `dwell_s` of a window."""
        held = window.last(self.dwell_s)
        if len(held) < self.least or held.t_s[-1] - held.t_s[0] < 0.8 * self.dwell_s:
            return ArmMotion.SHORT
        tips_m = arm.tip_m(held.q_rad)
        swing_rad = float(np.ptp(held.q_rad, axis=0).max())
        places_m, noise_m = self._places(tips_m)
        way_m = float(np.ptp(places_m, axis=0).max())
        stays = way_m <= max(self.place_m, self.sigmas * noise_m)
        return ArmMotion.STILL if stays and swing_rad <= self.joint_rad else ArmMotion.MOVING

    @staticmethod
    def _places(tips_m: Floats) -> tuple[Floats, float]:
        """Mean places (part, 3) and one sigma of each, from neighbouring samples so that drift does not count."""
        parts = np.array_split(tips_m, PARTS)
        noise_m = float(np.median(np.abs(np.diff(tips_m, axis=0)))) * 1.4826 / np.sqrt(2.0)
        return np.array([part.mean(axis=0) for part in parts]), noise_m / np.sqrt(len(parts[0]))
