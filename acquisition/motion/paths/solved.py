"""A path that needs no belt, solved beforehand: its stream costs nothing and never waits for a solution."""

import numpy as np
from numpy.typing import NDArray

from acquisition.motion.paths.path import STANDING, BeltState, Path

Floats = NDArray[np.float64]


class SolvedPath:
    """The solutions of a path at every period; between them, as in a hold, it is interpolated."""

    def __init__(self, path: Path, period_s: float) -> None:
        """RefusedMotionError where the path cannot be solved."""
        self._period_s = period_s
        solved: list[Floats] = []
        while len(solved) * period_s < path.ends_s + period_s:
            solved.append(path.at(len(solved) * period_s))
        self._q_rad = np.array(solved)
        self.ends_s, self.rests = path.ends_s, path.rests

    def at(self, t_s: float, belt: BeltState = STANDING) -> Floats:
        """Joint readings (joint,) at time t; at the end it stays."""
        place = min(t_s / self._period_s, len(self._q_rad) - 1.0)
        before = min(int(place + 1e-9), len(self._q_rad) - 2)
        share = place - before
        out: Floats = self._q_rad[before] + (self._q_rad[before + 1] - self._q_rad[before]) * share
        return out
