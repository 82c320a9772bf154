"""A gear ratio that the controller has wrong: the joint turns too far in proportion.

A friction or belt stage whose wheel diameter is off, or an encoder scale with a missing line: every turn is off alike.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class WrongRatio:
    """Drive of one joint that turns `excess` more than the controller believes (no unit)."""

    joint: int
    excess: float

    KIND: ClassVar[str] = "wrong-gear-ratio"
    PHYSICS: ClassVar[str] = "gear-ratio-error"
    SIZE: ClassVar[str] = "excess"
    TYPICAL: ClassVar[float] = 1e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
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
        return {"scale_error_rad_per_rad": self.excess}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        extra_rad[:, self.joint - 1] = self.excess * shaft_rad[:, self.joint - 1]
        return extra_rad
