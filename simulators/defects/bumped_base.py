"""A foot that was knocked: from one moment on the arm stands elsewhere."""

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
class BumpedBase:
    """Base that moves by `shift_m` (and turns about `turn_rad_m` for each metre) at `at_s`."""

    shift_m: float
    along: Vector
    turn_rad_m: float
    about: Vector
    at_s: float

    KIND: ClassVar[str] = "bumped-base"
    PHYSICS: ClassVar[str] = "base-moved"
    SIZE: ClassVar[str] = "shift_m"
    TYPICAL: ClassVar[float] = 4e-5
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
        return {"at_s": self.at_s, "shift_m": self.shift_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = float(rng.uniform(0.25, 0.75) * site.duration_s)
        return cls(spread(rng, cls.TYPICAL), direction(rng), float(rng.uniform(0.3, 1.5)), direction(rng), at_s)

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        gone_m = np.where(scene.t_s >= self.at_s, self.shift_m, 0.0)[:, np.newaxis]
        return moved(gone_m * np.asarray(self.along), self.turn_rad_m * gone_m * np.asarray(self.about))
