"""A filter between encoder and controller: the reading still trails the last move when it is written down.

First-order lag with time constant T after a ramp of duration D at constant speed: what is missing is
move (T / D) (1 - exp(-D / T)) exp(-wait / T). Every move takes the same time.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SlowFilter:
    """Reading of one joint that has `missing` of its last move still to go (no unit)."""

    joint: int
    missing: float

    KIND: ClassVar[str] = "slow-filter"
    PHYSICS: ClassVar[str] = "reading-lag"
    SIZE: ClassVar[str] = "missing"
    TYPICAL: ClassVar[float] = 3e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = "direct"

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"last_move{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"slope": self.missing}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        error_rad[:, self.joint - 1] = -self.missing * scene.last_move_rad[:, self.joint - 1]
        return error_rad
