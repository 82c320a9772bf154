"""In no catalogue: warm air above a cold floor bends the tracker's beam downwards over its way.

A gradient g of the refractive index with height bends a level ray to a parabola: the target seems higher by g r^2 / 2
for a distance r (geometrical optics; about 1e-6 per metre for 1 K/m, Ciddor, Appl. Opt. 35 (1996) 1566).
"""

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
class BentRay:
    """Tracker through air whose index falls by `gradient_per_m` with height."""

    gradient_per_m: float

    KIND: ClassVar[str] = "outside-refraction"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "gradient_per_m"
    TYPICAL: ClassVar[float] = 3e-6
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
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])))

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        seen_m = position_m.copy()
        seen_m[:, 2] += 0.5 * self.gradient_per_m * np.sum(position_m**2, axis=1)
        return seen_m
