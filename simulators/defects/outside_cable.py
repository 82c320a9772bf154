"""In no catalogue: a cable bundle between two joints winds up and pulls a third.

Its torque grows with the product of the two turns that wind it.
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
class CableBundle:
    """Joint that turns by `turn_rad` for each square radian of the product of two others' angles."""

    joint: int
    one: int
    other: int
    turn_rad: float

    KIND: ClassVar[str] = "outside-cable"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "turn_rad"
    TYPICAL: ClassVar[float] = 4e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.one}", f"q{self.other}")

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = int(rng.integers(3, site.n_joints + 1))
        return cls(joint, 1, 2, spread(rng, cls.TYPICAL))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        error_rad[:, self.joint - 1] = -self.turn_rad * shaft_rad[:, self.one - 1] * shaft_rad[:, self.other - 1]
        return error_rad
