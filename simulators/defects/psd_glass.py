"""The cover glass of a PSD: a slanting beam is shifted sideways on its way through.

A plate of thickness t and index n right above the face moves the spot against the beam's slant by
t (tan i - tan r), sin r = sin i / n (Snell; Hecht, "Optics", section 4.4). The plate's own reflections are left out.
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
class CoverGlass:
    """PSD under a glass of `thickness_m`."""

    psd: int
    thickness_m: float
    index: float = 1.52  # borosilicate at 635 nm

    KIND: ClassVar[str] = "psd-glass"
    PHYSICS: ClassVar[str] = "psd-cover-glass"
    SIZE: ClassVar[str] = "thickness_m"
    TYPICAL: ClassVar[float] = 5e-4
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"psd{self.psd}.reading"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"incidence{self.psd}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"thickness_m": self.thickness_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL))

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        beam = light.direction[:, self.psd - 1]
        sine = np.hypot(beam[:, 0], beam[:, 1])
        inside = sine / self.index
        shift_m = self.thickness_m * (sine / np.sqrt(1.0 - sine**2) - inside / np.sqrt(1.0 - inside**2))
        seen_m[:, self.psd - 1] -= shift_m[:, np.newaxis] * beam[:, :2] / np.maximum(sine, 1e-12)[:, np.newaxis]
        return seen_m
