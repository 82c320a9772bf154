"""In no catalogue: a chip under a tooth lifts a joint in one narrow range of its angle."""

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
class NarrowBump:
    """Joint that is off by `height_rad` around `at_rad`."""

    joint: int
    height_rad: float
    at_rad: float
    width_rad: float

    KIND: ClassVar[str] = "outside-bump"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "height_rad"
    TYPICAL: ClassVar[float] = 2e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.any_joint(rng)
        low_rad, high_rad = site.usual_rad[joint - 1]
        return cls(
            joint, spread(rng, cls.TYPICAL), float(rng.uniform(low_rad, high_rad)), float(rng.uniform(0.08, 0.2))
        )

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        own_rad = shaft_rad[:, self.joint - 1]
        error_rad[:, self.joint - 1] = -self.height_rad * np.exp(-0.5 * ((own_rad - self.at_rad) / self.width_rad) ** 2)
        return error_rad
