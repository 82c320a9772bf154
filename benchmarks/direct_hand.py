"""The emulated hand without wires, in its own time; the encoders count, and nothing is lost or late."""

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.reading import GuidedProgress, Request
from acquisition.guided.stillness import Window
from calibeam.guided.run import wish
from simulators.hand.held_arm import CannotReachError
from simulators.hand.world import HandWorld

Floats = NDArray[np.float64]
COUNTS = 1 << 20  # of simulators/encoders/object_dictionary.py


class DirectHand:
    """Implements acquisition.guided.stillness.EncoderWatch and acquisition.guided.reading.Guide."""

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
