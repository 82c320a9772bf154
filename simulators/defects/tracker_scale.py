"""A tracker whose length scale is off: wavelength of the laser, or air pressure typed in wrong."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrackerScale:
    """Tracker that tells every length `excess` too long (no unit)."""

    excess: float

    KIND: ClassVar[str] = "tracker-scale"
    PHYSICS: ClassVar[str] = "device-scale"
    SIZE: ClassVar[str] = "excess"
    TYPICAL: ClassVar[float] = 5e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("position",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "device.reading"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"scale": self.excess}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])))

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        return position_m * (1.0 + self.excess)
