"""A fixture that was knocked while it stood at a place: from then on it stands elsewhere, as long as it stays there."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import moved
from simulators.defects.directions import Vector, direction, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BumpedFixture:
    """Fixture that moves by `shift_m` (and turns about `turn` rad for each metre) at `at_s` within one place."""

    place: int
    shift_m: float
    along: Vector
    turn_rad_m: float
    about: Vector
    at_s: float
    until_s: float

    KIND: ClassVar[str] = "bumped-fixture"
    PHYSICS: ClassVar[str] = "fixture-moved"
    SIZE: ClassVar[str] = "shift_m"
    TYPICAL: ClassVar[float] = 3e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "fixture.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"at_s": self.at_s, "placement": float(self.place), "shift_m": self.shift_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        place = int(rng.choice(site.places))
        at_s, until_s = site.stay_s(place, rng)
        return cls(
            place, spread(rng, cls.TYPICAL), direction(rng), float(rng.uniform(0.0, 3.0)), direction(rng), at_s, until_s
        )

    def fixture_motion(self, scene: Scene) -> Floats:
        knocked = (scene.placement == self.place) & (scene.t_s >= self.at_s) & (scene.t_s < self.until_s)
        far_m = np.where(knocked, self.shift_m, 0.0)[:, np.newaxis]
        return moved(far_m * np.asarray(self.along), self.turn_rad_m * far_m * np.asarray(self.about))
