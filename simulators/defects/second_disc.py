"""The disc of a second encoder, not centred on its shaft: the controller's own reading is right, and so is the arm.

The same mechanism as `encoder_disc`, at the other encoder of the joint.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import phase, spread
from simulators.defects.encoder import RADIUS_M, EccentricDisc
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SecondDisc:
    """Second encoder of one joint, its disc `eccentricity_m` off the shaft."""

    joint: int
    eccentricity_m: float
    bearing_rad: float
    radius_m: float = RADIUS_M

    KIND: ClassVar[str] = "second-encoder-eccentricity"
    PHYSICS: ClassVar[str] = "encoder-eccentricity"
    SIZE: ClassVar[str] = "eccentricity_m"
    TYPICAL: ClassVar[float] = EccentricDisc.TYPICAL
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ()  # no instrument at the flange shows it
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
        return {"amplitude_rad": abs(self.eccentricity_m) / self.radius_m, "order": 1.0}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL), phase(rng))

    def second_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        disc = EccentricDisc(self.joint, self.eccentricity_m, self.bearing_rad, self.radius_m)
        return disc.reading_error_rad(shaft_rad, scene)
