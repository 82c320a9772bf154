"""A wrist whose drive shafts run through each other: joint j also turns joint i a little.

The concentric shafts of a wrist drive bevel gears; the controller takes the coupling out with a ratio, and what is
wrong with that ratio remains as a share of the other joint's turn.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site, UnsuitedError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class CoupledWrist:
    """Joint `joint` turns by `share` of joint `other` (no unit)."""

    joint: int
    other: int
    share: float

    KIND: ClassVar[str] = "coupled-wrist"
    PHYSICS: ClassVar[str] = "joint-coupling"
    SIZE: ClassVar[str] = "share"
    TYPICAL: ClassVar[float] = 1e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.other}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"coupling_rad_per_rad": self.share}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        if not site.gear_ratio or site.n_joints < 6:
            raise UnsuitedError("the arm has no driven wrist")
        joint, other = [(5, 4), (6, 5), (6, 4)][int(rng.integers(3))]
        return cls(joint, other, spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        extra_rad[:, self.joint - 1] = self.share * shaft_rad[:, self.other - 1]
        return extra_rad
