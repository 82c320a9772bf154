"""A PSD whose scale is off: amplifier gains and resistances give another length per volt in x and in y."""

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
class WrongGain:
    """PSD that tells `excess` too much along `x_share` of x and the rest of y (no unit)."""

    psd: int
    excess: float
    x_share: float

    KIND: ClassVar[str] = "psd-gain"
    PHYSICS: ClassVar[str] = "psd-gain"
    SIZE: ClassVar[str] = "excess"
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
        return {"gain_x_error_share": self.excess * self.x_share, "gain_y_error_share": self.excess}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(int(rng.integers(1, 3)), spread(rng, cls.TYPICAL), float(rng.uniform(-1.0, 1.0)))

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        gain = np.array([1.0 + self.excess * self.x_share, 1.0 + self.excess])
        seen_m[:, self.psd - 1] = spot_m[:, self.psd - 1] * gain
        return seen_m
