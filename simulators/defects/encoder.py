"""An encoder disc that is not centred on its shaft, read by one head.

The head stands at radius r from the shaft; the disc's centre is e off the shaft, at bearing b of the disc. Seen from
the disc's centre the head stands at another angle than seen from the shaft, by atan2(e sin(q - b), r + e cos(q - b)):
two points on a plane, exact for any e < r.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ANY_INSTRUMENT, phase, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]
RADIUS_M = 0.02  # graduation of an encoder of 40 to 60 mm housing


@dataclass(frozen=True)
class EccentricDisc:
    """Encoder of one joint, its disc `eccentricity_m` off the shaft."""

    joint: int
    eccentricity_m: float
    bearing_rad: float
    radius_m: float = RADIUS_M

    KIND: ClassVar[str] = "encoder-eccentricity"
    PHYSICS: ClassVar[str] = "encoder-eccentricity"
    SIZE: ClassVar[str] = "eccentricity_m"
    TYPICAL: ClassVar[float] = 2e-6  # 100 urad at 20 mm
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
        return {"amplitude_rad": abs(self.eccentricity_m) / self.radius_m, "order": 1.0}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL), phase(rng))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        turn_rad = shaft_rad[:, self.joint - 1] - self.bearing_rad
        aside_m = self.eccentricity_m * np.sin(turn_rad)
        error_rad[:, self.joint - 1] = -np.arctan2(aside_m, self.radius_m + self.eccentricity_m * np.cos(turn_rad))
        return error_rad
