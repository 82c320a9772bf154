"""A wire drum that runs out of round: each turn of it pays out a little more and a little less.

A drum of radius R whose centre is e off its shaft pays out, over a turn from angle a, R a + e (sin(a + b) - sin b)
(length of an off-centre circle to first order in e / R); the encoder counts turns, so the reading is off by that
second part.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import phase, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DrumOutOfRound:
    """Drum of `radius_m`, its centre `offset_m` off the shaft."""

    offset_m: float
    radius_m: float
    bearing_rad: float

    KIND: ClassVar[str] = "wire-drum-out-of-round"
    PHYSICS: ClassVar[str] = "device-periodic"
    SIZE: ClassVar[str] = "offset_m"
    TYPICAL: ClassVar[float] = 4e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("wire",)
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "device.reading"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("reading",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"amplitude_m": abs(self.offset_m), "period_m": 2.0 * np.pi * self.radius_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(spread(rng, cls.TYPICAL), float(rng.uniform(0.03, 0.06)), phase(rng))

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        turn_rad = length_m / self.radius_m
        return length_m - self.offset_m * (np.sin(turn_rad + self.bearing_rad) - np.sin(self.bearing_rad))
