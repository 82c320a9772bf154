"""A session step by step: between two steps it may be paused; a step that was broken off is done again.

After a pause the arm may stand elsewhere, for a motion was broken off or a person has moved it. It goes back to where
the last step ended, slowly as every motion, and from there on. The bench that a person can interrupt keeps what was
broken off by a pause apart from what has failed.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.centring.navigator import GLANCE_S, Navigator
from acquisition.session.control import Result, RunControl

Floats = NDArray[np.float64]


class InterruptibleBench:
    """Implements acquisition.bench.Bench. Every call may raise BrokenOffError or StoppedError beside what it raises."""

    def __init__(self, bench: Bench, control: RunControl) -> None:
        self._bench, self._control = bench, control

    def move(self, q_rad: Floats) -> None:
        self._control.move(self._bench.move, q_rad)

    def look(self, dwell_s: float) -> Look:
        self._control.check()
        return self._bench.look(dwell_s)

    def place_fixture(self, placement: int) -> None:
        self._bench.place_fixture(placement)

    def stop(self) -> None:
        self._bench.stop()


ELSEWHERE_RAD = 1e-3  # as acquisition/motion/gate.py: an arm further away was moved meanwhile


class Stepping:
    """Runs steps. `astray` is called when the arm was found elsewhere: what was known of the light may be wrong."""

    def __init__(self, control: RunControl, bench: Bench, navigator: Navigator, astray: Callable[[], None]) -> None:
        self._control, self._bench, self._navigator, self._astray = control, bench, navigator, astray

    def step(self, act: Callable[[], Result]) -> Result:
        """What `act` gives, once it was done without being broken off. Raises what ends a session."""
        return self._control.step(act, self._come_back, self._astray)

    def _come_back(self) -> None:
        back_rad = self._navigator.q_rad - self._bench.look(GLANCE_S).q_rad
        if float(np.max(np.abs(back_rad))) <= ELSEWHERE_RAD:
            return
        self._astray()
        came = np.where(np.abs(back_rad) > ELSEWHERE_RAD, np.sign(back_rad), self._navigator.approach)
        self._navigator.move(self._navigator.q_rad)
        self._navigator.approach = came.astype(np.int64)
