"""A laser diode that has just been switched on: its beam turns while it warms.

Body of one thermal mass: the turn is `turn_rad` (1 - exp(-t / time_constant)) about a fixed axis of the housing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import Vector, direction, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LaserWarmUp:
    """Laser whose beam turns by `turn_rad` until it is warm."""

    turn_rad: float
    time_constant_s: float
    axis: Vector

    KIND: ClassVar[str] = "laser-warm-up"
    PHYSICS: ClassVar[str] = "laser-warm-up"
    SIZE: ClassVar[str] = "turn_rad"
    TYPICAL: ClassVar[float] = 3e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "laser.direction"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"turn_rad": self.turn_rad, "time_constant_s": self.time_constant_s}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), float(rng.uniform(0.05, 0.25) * site.duration_s), direction(rng))

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        warm = 1.0 - np.exp(-scene.t_s / self.time_constant_s)
        return turned(self.turn_rad * warm[:, np.newaxis] * np.asarray(self.axis))
