"""The whole arm grows with the room: every link alike, along the line between its joints."""

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
class WarmArm:
    """Arm that grows by `expansion_per_k`."""

    expansion_per_k: float
    joints: int

    KIND: ClassVar[str] = "warm-arm"
    PHYSICS: ClassVar[str] = "link-thermal-growth"
    SIZE: ClassVar[str] = "expansion_per_k"
    TYPICAL: ClassVar[float] = 23e-6
    LARGEST: ClassVar[float] = 60e-6  # aluminium, and a thermometer that sees less than half of the warmth
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "link*.length"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("temp_room",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("temp_room_degC",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"expansion_per_k": self.expansion_per_k}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), site.n_joints)

    @property
    def links(self) -> tuple[int, ...]:
        return tuple(range(self.joints + 1))

    def link_motion(self, link: int, end_m: Floats, angle_rad: Floats, scene: Scene, load: Load) -> Floats:
        return shifted(self.expansion_per_k * scene.warmed_k("room")[:, np.newaxis] * end_m)
