"""A link that its motor warms: it grows in proportion to its temperature.

Length times expansion coefficient times temperature difference (aluminium 23e-6/K, cast iron 11e-6/K: any handbook of
materials); the end of the link moves away from its joint along the line between the two.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import shifted
from simulators.defects.directions import ANY_INSTRUMENT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class HeatedLink:
    """Link of one joint that grows by `expansion_per_k`."""

    link: int
    expansion_per_k: float

    KIND: ClassVar[str] = "heated-link"
    PHYSICS: ClassVar[str] = "link-thermal-growth"
    SIZE: ClassVar[str] = "expansion_per_k"
    TYPICAL: ClassVar[float] = 23e-6
    LARGEST: ClassVar[float] = 60e-6  # aluminium, and a thermometer that sees less than half of the warmth
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"link{self.link}.length"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"temp_link{self.link}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return (f"temp_link{self.link}_degC",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"expansion_per_k": self.expansion_per_k}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng), spread(rng, cls.TYPICAL))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        return shifted(self.expansion_per_k * scene.warmed_k(f"link{link}")[:, np.newaxis] * end_m)
