"""A PSD whose electrodes are not square to each other: a spot's y shows in its x."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import spread
from simulators.defects.scene import Light, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SkewedElectrodes:
    """PSD that adds `skew` of y to x (rad)."""

    psd: int
    skew: float

    KIND: ClassVar[str] = "psd-skewed"
    PHYSICS: ClassVar[str] = "psd-gain"
    SIZE: ClassVar[str] = "skew"
    TYPICAL: ClassVar[float] = 2e-3
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
        return {"cross": self.skew}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL) * float(rng.choice([-1.0, 1.0])))

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        seen_m[:, self.psd - 1, 0] += self.skew * spot_m[:, self.psd - 1, 1]
        return seen_m
