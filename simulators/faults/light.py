"""The light on the faces, which trouble can make too strong or take away; everything else is the world's.

What it does not imitate: a spot that leaves the face slowly, or one face alone.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
BLINDING_GAIN = 1e4  # a lit face gives tens of microamperes, the converters of such boxes end below a milliampere


class LitWorld(Protocol):
    """What is wrapped."""

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats: ...


class DisturbedLight:
    """A world as the PSD electronics see it."""

    def __init__(self, world: LitWorld) -> None:
        self._world = world
        self.gain = 1.0  # of the laser's power; 0 is a spot that has left both faces

    def photocurrents_a(self, times_s: Sequence[float] | Floats) -> Floats:
        """(sample, 8) A, as the world's `photocurrents_a`."""
        return self.gain * self._world.photocurrents_a(times_s)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)
