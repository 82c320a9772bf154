"""Clocks that disagree.

The instrument's sample is taken `late_s` after the joints were read, while the arm moves on.
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
class LateClock:
    """Instrument that reads `late_s` after the encoders."""

    late_s: float
    joints: int

    KIND: ClassVar[str] = "late-clock"
    PHYSICS: ClassVar[str] = "latency"
    SIZE: ClassVar[str] = "late_s"
    TYPICAL: ClassVar[float] = 2e-3
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = "moving"

    @property
    def port(self) -> str:
        return "time"

    @property
    def drivers(self) -> tuple[str, ...]:
        return tuple(f"qd{joint}" for joint in range(1, self.joints + 1))

    @property
    def needs(self) -> tuple[str, ...]:
        return ("qd",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"delay_s": self.late_s}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])), site.n_joints)

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        return self.late_s * scene.qd_rad_s
