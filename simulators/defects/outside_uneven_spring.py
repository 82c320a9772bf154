"""In no catalogue.

A drive whose stiffness goes up and down three times a turn, as its three planets take the load in turn.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, phase, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class UnevenSpring:
    """Drive of one joint that turns `compliance_rad_nm` (1 + 0.9 sin(3 q + phase)) per newton metre."""

    joint: int
    compliance_rad_nm: float
    bearing_rad: float

    KIND: ClassVar[str] = "outside-uneven-spring"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "compliance_rad_nm"
    TYPICAL: ClassVar[float] = 8e-6
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"gravity_torque{self.joint}", f"q{self.joint}")

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.loaded_joint(rng), spread(rng, cls.TYPICAL), phase(rng))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        own = self.joint - 1
        uneven = 1.0 + 0.9 * np.sin(3.0 * shaft_rad[:, own] + self.bearing_rad)
        extra_rad[:, own] = self.compliance_rad_nm * uneven * load.torque_nm[:, own]
        return extra_rad
