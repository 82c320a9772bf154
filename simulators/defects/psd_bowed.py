"""A PSD whose resistive layer thickens towards one edge: positions bend off in second order.

x' = x + k (x^2 / H) along one direction of the face: the first uneven term of a layer whose sheet resistance has a
slope.
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
class BowedScale:
    """PSD whose scale is off by `bow` at the edge (no unit)."""

    psd: int
    bow: float
    towards_rad: float
    half_size_m: float

    KIND: ClassVar[str] = "psd-bowed"
    PHYSICS: ClassVar[str] = "psd-nonlinearity"
    SIZE: ClassVar[str] = "bow"
    TYPICAL: ClassVar[float] = 3e-3
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
        return {"quadratic": self.bow}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL), phase(rng), site.half_size_m)

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        along = np.array([np.cos(self.towards_rad), np.sin(self.towards_rad)])
        far_m = spot_m[:, self.psd - 1] @ along
        seen_m[:, self.psd - 1] += (self.bow * far_m**2 / self.half_size_m)[:, np.newaxis] * along
        return seen_m
