"""A guided session on the emulated hand without wires, its own time instead of anybody's clock: for benchmarks.

What the wires add, quantisation of the encoders, is done here too; nothing is ever lost or late.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.guide import GuidedProgress, Request
from acquisition.guided.target import BarEnd, Cone, Target
from acquisition.guided.window import Window
from simulators.hand.hand import CannotReachError
from simulators.hand.world import HandWorld

Floats = NDArray[np.float64]
COUNTS = 1 << 20  # of simulators/encoders/encoder.py


class DirectHand:
    """Implements acquisition.guided.window.EncoderWatch and acquisition.guided.guide.Guide."""

    def __init__(self, world: HandWorld, period_s: float = 0.025) -> None:
        self.world, self._period_s = world, period_s
        self._times_s: list[float] = []
        self._readings: list[Floats] = []

    def next(self, seconds: float) -> Window:
        self.world.advance(self.world.time_s + self._period_s)
        self._times_s.append(self.world.time_s)
        self._readings.append(np.floor(self.world.link_encoders_rad() / (2.0 * np.pi) * COUNTS) / COUNTS * 2.0 * np.pi)
        count = max(1, round(seconds / self._period_s) + 1)
        t_s = np.array(self._times_s[-count:])
        return Window(t_s, t_s, np.array(self._readings[-count:]))

    def dwell(self, seconds: float) -> Window:
        """A whole stretch of new samples."""
        for _ in range(round(seconds / self._period_s)):
            self.next(seconds)
        return self.next(seconds)

    def ask(self, request: Request) -> bool:
        try:
            self.world.put(**wish(request.target, request.posture_rad))
        except CannotReachError:
            return False
        self.world.advance(self.world.arrives_s)  # nobody has to watch the way there
        return True

    def tell(self, progress: GuidedProgress) -> None:
        """Nobody looks."""


def wish(target: Target, posture_rad: Floats) -> Mapping[str, Any]:
    """What the emulated hand is asked for, in the words of its verb "hand.put"."""
    posture = [float(q) for q in posture_rad]
    if isinstance(target, Cone):
        return {"what": "seat", "id": target.id, "posture_rad": posture}
    if isinstance(target, BarEnd):
        return {"what": "bar", "id": target.position, "end": target.end, "posture_rad": posture}
    return {"what": "sphere", "id": target.id, "direction": list(target.direction), "posture_rad": posture}
