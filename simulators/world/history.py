"""What the detectors saw since the last advance, one knot a physics step, for samples that fall in between.

Currents are worked out only when somebody samples; a straight line between two knots is exact for a spot that moves
evenly (at 1 rad/s and 1 m it bends by less than 1 um in a millisecond) and shows a beam that runs off a face as a
short fall of the sum.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from simulators.world.model import STEP_S
from simulators.world.optics import Ray

Floats = NDArray[np.float64]
EDGE_S = 1e-9  # rounding of times that are multiples of a sampling interval
ON_KNOT = EDGE_S / STEP_S


class Knot:
    """The beam at one physics step; what the detectors see of it, (2, 8) A, is found once."""

    __slots__ = ("_seen", "beam")

    def __init__(self, beam: Ray) -> None:
        self.beam = beam
        self._seen: Floats | None = None

    def seen(self, see: Callable[[Ray], Floats]) -> Floats:
        if self._seen is None:
            self._seen = see(self.beam)
        return self._seen


def interpolate(knots: list[Knot], start_s: float, times_s: list[float], see: Callable[[Ray], Floats]) -> Floats:
    """Mean currents and their sigma at times, (sample, 2, 8) A; the last knot holds on for as long as the arm stands.

    A loop, because a tick has a few samples only and most of them fall on a knot.
    """
    return np.array([_at((time_s - start_s) / STEP_S, knots, see) for time_s in times_s])


def _at(place: float, knots: list[Knot], see: Callable[[Ray], Floats]) -> Floats:
    before = int(place + ON_KNOT)
    if before >= len(knots) - 1:
        return knots[-1].seen(see)
    share = place - before
    if share <= ON_KNOT:
        return knots[before].seen(see)
    return (1.0 - share) * knots[before].seen(see) + share * knots[before + 1].seen(see)
