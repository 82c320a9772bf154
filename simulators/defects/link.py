"""A link that bends like a clamped beam under the weight at its end.

End load F across it and moment M at the end: deflection F L^3 / 3EI + M L^2 / 2EI, slope F L^2 / 2EI + M L / EI
(clamped beam of constant section; any text on strength of materials). The link's own weight counts as hung at its end.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import shifted, turned_about
from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BendingLink:
    """Link with `bending_per_nm2` = 1 / (E I), alike about all axes across it."""

    link: int
    bending_per_nm2: float

    KIND: ClassVar[str] = "bending-link"
    PHYSICS: ClassVar[str] = "link-bending"
    SIZE: ClassVar[str] = "bending_per_nm2"
    TYPICAL: ClassVar[float] = 5e-5  # aluminium tube of 50 mm and 5 mm wall
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"link{self.link}.tilt"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"gravity_torque{self.link}", f"gravity_torque{self.link + 1}")

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"bending_per_nm2": self.bending_per_nm2}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.long_link(rng, carrying=True), spread(rng, cls.TYPICAL))

    @property
    def links(self) -> tuple[int, ...]:
        return (self.link,)

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        length_m = float(np.linalg.norm(end_m))
        along = end_m / length_m
        force_n, moment_nm = load.force_n[:, link], load.moment_nm[:, link]
        across_n = force_n - (force_n @ along)[:, np.newaxis] * along
        end_nm = moment_nm - np.cross(end_m, force_n)
        end_nm = end_nm - (end_nm @ along)[:, np.newaxis] * along
        sag_m = across_n * length_m**3 / 3.0 + np.cross(end_nm, along) * length_m**2 / 2.0
        slope_rad = np.cross(along, across_n) * length_m**2 / 2.0 + end_nm * length_m
        bend = self.bending_per_nm2
        return shifted(bend * sag_m) @ turned_about(end_m, bend * slope_rad)
