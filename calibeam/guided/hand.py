"""The emulated hand as a guide: it does what a person would be asked to do, over the side channel or without wires.

Without wires it has its own time, for benchmarks. Quantisation of the encoders is included; nothing is lost or late.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.guided.guide import GuidedProgress, Request
from acquisition.guided.reading import BarEnd, Cone, Target
from acquisition.guided.stillness import Window
from calibeam.emulation import EmulationError
from simulators.hand.held_arm import CannotReachError
from simulators.hand.world import HandWorld

Floats = NDArray[np.float64]
COUNTS = 1 << 20  # of simulators/encoders/object_dictionary.py


class DirectHand:
    """Implements acquisition.guided.stillness.EncoderWatch and acquisition.guided.guide.Guide."""

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


Ask = Callable[..., Any]  # verb, arguments by name
CANNOT = "cannot put the probe"  # how simulators/hand/held_arm.py says that the arm has no such posture


class EmulatedHand:
    """Implements acquisition.guided.guide.Guide; what is told goes on to `show`."""

    def __init__(self, ask: Ask, show: Callable[[GuidedProgress], None]) -> None:
        self._ask, self._show = ask, show

    def ask(self, request: Request) -> bool:
        try:
            self._ask("hand.put", **wish(request.target, request.posture_rad))
        except EmulationError as refused:
            if CANNOT in str(refused):
                return False
            raise
        return True

    def tell(self, progress: GuidedProgress) -> None:
        self._show(progress)
