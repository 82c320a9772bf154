"""A table or a foot that settles: the arm slowly moves and turns, more slowly as time goes on."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import moved
from simulators.defects.directions import Vector, direction, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DriftingBase:
    """Base that moves by `shift_m` in the end, with one time constant."""

    shift_m: float
    along: Vector
    turn_rad_m: float
    about: Vector
    time_constant_s: float

    KIND: ClassVar[str] = "drifting-base"
    PHYSICS: ClassVar[str] = "base-moved"
    SIZE: ClassVar[str] = "shift_m"
    TYPICAL: ClassVar[float] = 5e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd", "seat")
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "base.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"shift_m": self.shift_m, "time_constant_s": self.time_constant_s}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        time_constant_s = float(rng.uniform(0.2, 0.6) * site.duration_s)
        return cls(
            spread(rng, cls.TYPICAL), direction(rng), float(rng.uniform(0.3, 1.5)), direction(rng), time_constant_s
        )

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        gone_m = self.shift_m * (1.0 - np.exp(-scene.t_s / self.time_constant_s))[:, np.newaxis]
        return moved(gone_m * np.asarray(self.along), self.turn_rad_m * gone_m * np.asarray(self.about))
