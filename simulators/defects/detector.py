"""A PSD whose lines of equal position bow: spots are told too far out towards the edge.

r' = r (1 + k r^2 / H^2), H half the face: the third-order term of a resistive-layer PSD (Wang and Busch-Vishniac, "The
linearity and sensitivity of lateral effect PSDs", IEEE Trans. Electron Devices 36 (1989) 2475).
"""

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
class Pincushion:
    """PSD that tells spots at the edge `distortion` too far out (no unit)."""

    psd: int
    distortion: float
    half_size_m: float

    KIND: ClassVar[str] = "psd-pincushion"
    PHYSICS: ClassVar[str] = "psd-nonlinearity"
    SIZE: ClassVar[str] = "distortion"
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
        return {"edge_share": self.distortion}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL), site.half_size_m)

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        own_m = spot_m[:, self.psd - 1]
        out = np.sum(own_m**2, axis=1, keepdims=True) / self.half_size_m**2
        seen_m[:, self.psd - 1] = own_m * (1.0 + self.distortion * out)
        return seen_m
