"""A cone that was pushed: from one moment on its seat is elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import Vector, direction, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class MovedCone:
    """Cone that moves by `shift_m` at `at_s`."""

    cone: int
    shift_m: float
    along: Vector
    at_s: float

    KIND: ClassVar[str] = "moved-cone"
    PHYSICS: ClassVar[str] = "seat-moved"
    SIZE: ClassVar[str] = "shift_m"
    TYPICAL: ClassVar[float] = 4e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("seat",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "seat.position"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"at_s": self.at_s, "seat": float(self.cone), "shift_m": self.shift_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = float(rng.uniform(0.25, 0.75) * site.duration_s)
        return cls(int(rng.choice(site.seats)), spread(rng, cls.TYPICAL), direction(rng), at_s)

    def seat_shift_m(self, scene: Scene) -> Floats:
        pushed = (scene.seat == self.cone) & (scene.t_s >= self.at_s)
        return np.where(pushed, self.shift_m, 0.0)[:, np.newaxis] * np.asarray(self.along)
