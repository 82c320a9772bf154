"""In no catalogue.

A bracket of two metals in the draught of a cabinet fan bends the tool aside, as fast as the fan runs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import ROBOT, Vector, direction, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FanOnBracket:
    """Tool that turns by `turn_rad` per 1000 rpm of the fan."""

    turn_rad: float
    axis: Vector
    at_laser: bool

    KIND: ClassVar[str] = "outside-fan"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "turn_rad"
    TYPICAL: ClassVar[float] = 5e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "laser.direction" if self.at_laser else "tool.point"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("fan_rpm",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("fan_rpm",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), direction(rng), site.instrument == "dual-psd")

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        speed = (scene.extra["fan_rpm"] - scene.extra["fan_rpm"][0]) / 1000.0
        return turned(self.turn_rad * speed[:, np.newaxis] * np.asarray(self.axis))
