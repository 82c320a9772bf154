"""Light of the room on a PSD: the reading is drawn towards where that light falls, the more the weaker the laser is.

A PSD gives the centre of all its light: (S x + A o) / (S + A), with S and A the sum signals of laser and room and o the
centre of the room's light. A window lets A change with the hour; the sum signal shows S + A.
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
class StrayLight:
    """Room light of `stray_v` on one PSD, its centre at `centre_m`."""

    psd: int
    stray_v: float
    centre_m: tuple[float, float]
    hour_s: float

    KIND: ClassVar[str] = "psd-stray-light"
    PHYSICS: ClassVar[str] = "psd-ambient-light"
    SIZE: ClassVar[str] = "stray_v"
    TYPICAL: ClassVar[float] = 0.02
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("dual-psd",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"psd{self.psd}.reading"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"psd{self.psd}_sum",)

    @property
    def needs(self) -> tuple[str, ...]:
        return (f"psd{self.psd}_sum_v",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"stray_v": self.stray_v}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        x_m, y_m = (float(value) for value in 0.7 * site.half_size_m * rng.uniform(-1.0, 1.0, 2))
        return cls(
            int(rng.integers(1, 3)),
            spread(rng, cls.TYPICAL),
            (x_m, y_m),
            float(rng.uniform(0.3, 1.0) * site.duration_s),
        )

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        own = self.psd - 1
        laser_v, stray_v = light.sum_v[:, own, np.newaxis], self._stray_v(scene)[:, np.newaxis]
        seen_m[:, own] = (laser_v * spot_m[:, own] + stray_v * np.asarray(self.centre_m)) / (laser_v + stray_v)
        return seen_m

    def seen_sum_v(self, sum_v: Floats, scene: Scene) -> Floats:
        seen_v = sum_v.copy()
        seen_v[:, self.psd - 1] += self._stray_v(scene)
        return seen_v

    def _stray_v(self, scene: Scene) -> Floats:
        return self.stray_v * (1.0 + 0.6 * np.sin(2.0 * np.pi * scene.t_s / self.hour_s))
