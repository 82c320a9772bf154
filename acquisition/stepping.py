"""A session step by step: between two steps it may be paused; a step that was broken off is done again.

After a pause the arm may stand elsewhere, for a motion was broken off or a person has moved it. It goes back to where
the last step ended, slowly as every motion, and from there on.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from acquisition.bench import Bench
from acquisition.centring.navigator import GLANCE_S, Navigator
from acquisition.reins import BrokenOffError, Reins

Result = TypeVar("Result")

ELSEWHERE_RAD = 1e-3  # as acquisition/motion/gate.py: an arm further away was moved meanwhile


class Stepping:
    """Runs steps. `astray` is called when the arm was found elsewhere: what was known of the light may be wrong."""

    def __init__(self, reins: Reins, bench: Bench, navigator: Navigator, astray: Callable[[], None]) -> None:
        self._reins, self._bench, self._navigator, self._astray = reins, bench, navigator, astray

    def step(self, act: Callable[[], Result]) -> Result:
        """What `act` gives, once it was done without being broken off. Raises what ends a session."""
        waited = False
        while True:
            waited = self._reins.checkpoint() or waited
            try:
                if waited:
                    self._come_back()
                    waited = False
                return act()
            except BrokenOffError:
                self._astray()
                waited = True

    def _come_back(self) -> None:
        back_rad = self._navigator.q_rad - self._bench.look(GLANCE_S).q_rad
        if float(np.max(np.abs(back_rad))) <= ELSEWHERE_RAD:
            return
        self._astray()
        came = np.where(np.abs(back_rad) > ELSEWHERE_RAD, np.sign(back_rad), self._navigator.approach)
        self._navigator.move(self._navigator.q_rad)
        self._navigator.approach = came.astype(np.int64)
