"""The encoders of a guided session on real wires: whole rows of the newest time, as the reader thread brings them."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.window import Window
from acquisition.streams import Pump
from acquisition.supervisor import Supervisor
from drivers.device import Block

Floats = NDArray[np.float64]
SILENCE_S = 1.0  # host time without a sample after which a wait gives up: longer than the reader's own


class WiredEncoderWatch:
    """Implements acquisition.guided.window.EncoderWatch. `hurry`: device seconds in one second of the host."""

    def __init__(self, pump: Pump, supervisor: Supervisor, hurry: float = 1.0) -> None:
        self._pump, self._supervisor, self._hurry = pump, supervisor, hurry
        self._blocks: deque[Block] = deque()
        self._seen_s = -np.inf

    def next(self, seconds: float) -> Window:
        while True:
            self._supervisor.check()
            arrived = self._pump.wait(self._seen_s, SILENCE_S)
            self._seen_s = float(arrived[-1].host_s[-1])
            self._blocks += arrived
            while self._blocks[0].device_s[-1] < self._blocks[-1].device_s[-1] - 1.5 * seconds / self._hurry:
                self._blocks.popleft()
            window = self._whole()
            if len(window):
                return window

    def _whole(self) -> Window:
        """Rows in which every encoder answered."""
        t_s = np.concatenate([block.device_s for block in self._blocks]) * self._hurry
        host_s = np.concatenate([block.host_s for block in self._blocks])
        q_rad = np.concatenate([block.values["position_rad"] for block in self._blocks])
        whole = np.all(np.isfinite(q_rad), axis=1)
        return Window(t_s[whole], host_s[whole], q_rad[whole])
