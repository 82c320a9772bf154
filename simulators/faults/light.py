"""The light on the faces, which trouble can make too strong or take away; everything else is the world's.

What it does not imitate: a spot that leaves the face slowly, or one face alone.
"""

import math
from collections.abc import Hashable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
BLINDING_GAIN = 1e4  # a lit face gives tens of microamperes, the converters of such boxes end below a milliampere


class LitWorld(Protocol):
    """What is wrapped."""

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats: ...


class DisturbedLight:
    """A world as the PSD electronics see it. Several disturbances multiply; each is mended by itself."""

    def __init__(self, world: LitWorld) -> None:
        self._world = world
        self._gains: dict[Hashable, float] = {}  # whose -> of the laser's power

    def disturb(self, whose: Hashable, gain: float) -> None:
        """`gain` of the laser's power; 0 is a spot that has left both faces."""
        self._gains[whose] = gain

    def mend(self, whose: Hashable) -> None:
        """As if that one had not been."""
        self._gains.pop(whose, None)

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats:
        """(sample, 8) A, as the world's `photocurrents_a`."""
        current_a = self._world.photocurrents_a(times_s)
        return math.prod(self._gains.values()) * current_a if self._gains else current_a

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)
