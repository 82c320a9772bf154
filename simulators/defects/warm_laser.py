"""A laser module whose beam turns in proportion to its temperature."""

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
class WarmLaser:
    """Laser whose beam turns by `turn_rad_k` per kelvin."""

    turn_rad_k: float
    axis: Vector

    KIND: ClassVar[str] = "warm-laser"
    PHYSICS: ClassVar[str] = "laser-thermal-drift"
    SIZE: ClassVar[str] = "turn_rad_k"
    TYPICAL: ClassVar[float] = 6e-6  # 2 to 12 urad/K
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "laser.direction"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("temp_laser",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("temp_laser_degC",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"slope_rad_k": self.turn_rad_k}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), direction(rng))

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.turn_rad_k * scene.warmed_k("laser")[:, np.newaxis] * np.asarray(self.axis))
