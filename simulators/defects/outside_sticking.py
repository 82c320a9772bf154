"""In no catalogue: a brake pad grips at a random level each time, so that a joint rests at one of three places.

Nothing that is recorded tells at which.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ANY_INSTRUMENT, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StickingPad:
    """Joint that rests `turn_rad` low, even or high, at random."""

    joint: int
    turn_rad: float
    dice: int

    KIND: ClassVar[str] = "outside-sticking"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "turn_rad"
    TYPICAL: ClassVar[float] = 6e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ()

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL), int(rng.integers(2**31)))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        level = np.random.default_rng(self.dice).integers(-1, 2, len(scene))
        error_rad[:, self.joint - 1] = self.turn_rad * level
        return error_rad
