"""In no catalogue.

A scratch-free window in front of a PSD makes fringes with the laser, and readings ripple across the face.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import phase, spread
from simulators.defects.scene import Light, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Fringes:
    """PSD whose reading ripples by `ripple_m` with the place on the face."""

    psd: int
    ripple_m: float
    period_m: float
    towards_rad: float

    KIND: ClassVar[str] = "outside-fringes"
    PHYSICS: ClassVar[str] = "unknown"
    SIZE: ClassVar[str] = "ripple_m"
    TYPICAL: ClassVar[float] = 4e-6
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"psd{self.psd}.reading"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"spot{self.psd}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        period_m = float(rng.uniform(0.25, 0.6) * site.half_size_m)
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL), period_m, phase(rng))

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        along = np.array([np.cos(self.towards_rad), np.sin(self.towards_rad)])
        ripple_m = self.ripple_m * np.sin(2.0 * np.pi * (spot_m[:, self.psd - 1] @ along) / self.period_m)
        seen_m[:, self.psd - 1] += ripple_m[:, np.newaxis] * along
        return seen_m
