"""A bench whose motions a person can break off: what is broken off by a pause is told apart from what has failed."""

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Bench, Look
from acquisition.reins import Reins
from drivers.errors import DeviceError

Floats = NDArray[np.float64]


class ReinedBench:
    """Implements acquisition.bench.Bench. Every call may raise BrokenOffError or StoppedError beside what it raises."""

    def __init__(self, bench: Bench, reins: Reins) -> None:
        self._bench, self._reins = bench, reins

    def move(self, q_rad: Floats) -> None:
        self._reins.check(begins=True)
        try:
            self._bench.move(q_rad)
        except DeviceError:
            self._reins.check()  # it was the pause that ended the motion
            raise
        self._reins.check()  # an arm that stood before the stop came has arrived all the same: it counts as broken off

    def look(self, dwell_s: float) -> Look:
        self._reins.check()
        return self._bench.look(dwell_s)

    def place_fixture(self, placement: int) -> None:
        self._bench.place_fixture(placement)

    def stop(self) -> None:
        self._bench.stop()
