"""A pedestal that leans under the overturning moment of the arm on it.

A spring against tilting in two directions: tilt = moment / stiffness, about the foot. Twisting about the vertical
carries no weight and stays.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import turned
from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SoftPedestal:
    """Pedestal that leans `compliance_rad_nm` per newton metre."""

    compliance_rad_nm: float

    KIND: ClassVar[str] = "soft-pedestal"
    PHYSICS: ClassVar[str] = "base-compliance"
    SIZE: ClassVar[str] = "compliance_rad_nm"
    TYPICAL: ClassVar[float] = 2e-6
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "base.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("overturning_moment",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"compliance_rad_nm": self.compliance_rad_nm}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL))

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.compliance_rad_nm * load.moment_nm[:, 0] * np.array([1.0, 1.0, 0.0]))
