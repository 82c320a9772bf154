"""Bearings of the emulated arm: while a joint turns, its axis leans, runs out sideways, and goes up and down.

Seen from the housing the axis leans, or stands aside, towards (cos(k q + b), sin(k q + b)): lobes of a race that come
back k times a turn (Bryan, Clouser and Holland, "Spindle accuracy", American Machinist 1967: tilt, radial and axial
error motion). k = 1 would turn with the joint, k = 0 stand still: both are geometry. Axially every k counts, for
nothing of a link goes to and fro with an angle.
Does not imitate: what does not come back with the angle (rolling elements, dirt, play).
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import moved
from simulators.hand.truth import TrueAxis, TrueRunout

Floats = NDArray[np.float64]


class Bearings:
    """Of all joints of one arm."""

    def __init__(self, axes: Sequence[TrueAxis], runouts: Sequence[TrueRunout]) -> None:
        self._lean_rad = np.array([axis.lean_rad for axis in axes])
        self._lean_rate = np.array([axis.cycles - 1 for axis in axes])
        self._lean_bearing_rad = np.array([axis.bearing_rad for axis in axes])
        self._aside_m = np.array([one.radial_m for one in runouts])
        self._aside_rate = np.array([one.radial_cycles - 1 for one in runouts])
        self._aside_bearing_rad = np.array([one.radial_bearing_rad for one in runouts])
        self._along_m = np.array([one.axial_m for one in runouts])
        self._along_rate = np.array([one.axial_cycles for one in runouts])
        self._along_bearing_rad = np.array([one.axial_bearing_rad for one in runouts])

    def motions(self, joint_rad: Floats) -> Mapping[int, Floats]:
        """(row, 4, 4) by link, in the frame that turns with joint i, at the start of the link behind it: number i + 1.

        Rates are those seen from that frame; nothing of perfect bearings.
        """
        if not (self._lean_rad.any() or self._aside_m.any() or self._along_m.any()):
            return {}
        lean_rad = self._lean_rad[:, np.newaxis] * _towards(self._lean_rate * joint_rad + self._lean_bearing_rad)
        shift_m = self._aside_m[:, np.newaxis] * _towards(self._aside_rate * joint_rad + self._aside_bearing_rad)
        shift_m[..., 2] = self._along_m * np.sin(self._along_rate * joint_rad + self._along_bearing_rad)
        motion = moved(shift_m, lean_rad)
        return {index + 1: motion[:, index] for index in range(joint_rad.shape[1])}


def _towards(bearing_rad: Floats) -> Floats:
    """(row, n, 3) unit vectors across z."""
    return np.stack((np.cos(bearing_rad), np.sin(bearing_rad), np.zeros_like(bearing_rad)), axis=2)
