"""In no catalogue: two gear trains on one shaft beat, once per turn of one joint less two of another."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ANY_INSTRUMENT, phase, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class GearBeat:
    """Joint that turns by `turn_rad` sin(qi - 2 qj + phase)."""

    joint: int
    other: int
    turn_rad: float
    bearing_rad: float

    KIND: ClassVar[str] = "outside-beat"
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
        return (f"q{self.joint}", f"q{self.other}")

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint, other = (int(number) + 1 for number in rng.permutation(site.n_joints)[:2])
        return cls(joint, other, spread(rng, cls.TYPICAL), phase(rng))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        beat_rad = shaft_rad[:, self.joint - 1] - 2.0 * shaft_rad[:, self.other - 1] + self.bearing_rad
        error_rad[:, self.joint - 1] = -self.turn_rad * np.sin(beat_rad)
        return error_rad
