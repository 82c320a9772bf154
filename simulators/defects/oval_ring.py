"""An encoder ring that was pressed oval, read by one head.

Mechanism: radius r (1 + k cos 2(q - b)); marks keep their distance along the rim, so the angle per mark grows where
the rim stands far out. The rim of a slightly oval ring is, to second order in k, marked at angle q + (k/2) sin 2(q -
b); the reading here is the exact ratio of arc lengths, s(q)/s(2 pi), integrated on a fine grid.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from simulators.defects.directions import ANY_INSTRUMENT, phase, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]
GRID = 721  # half a degree: the trapezium rule on a periodic curve is exact far below 1e-9 rad


@dataclass(frozen=True)
class OvalRing:
    """Encoder of one joint, its ring oval by `ovality` (largest radius over mean radius, less 1)."""

    joint: int
    ovality: float
    bearing_rad: float

    KIND: ClassVar[str] = "oval-ring"
    PHYSICS: ClassVar[str] = "encoder-harmonic"
    SIZE: ClassVar[str] = "ovality"
    TYPICAL: ClassVar[float] = 1e-4  # 50 urad
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"amplitude_rad": 0.5 * abs(self.ovality), "order": 2.0}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), spread(rng, cls.TYPICAL), phase(rng))

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        error_rad = np.zeros_like(shaft_rad)
        turn_rad = shaft_rad[:, self.joint - 1] - self.bearing_rad
        error_rad[:, self.joint - 1] = self._marked_rad(turn_rad) - turn_rad
        return error_rad

    def _marked_rad(self, turn_rad: Floats) -> Floats:
        """Angle that the marks tell for places at true angle `turn_rad` (row,), continued beyond a turn."""
        place_rad = np.linspace(-np.pi, np.pi, GRID)
        radius = 1.0 + self.ovality * np.cos(2.0 * place_rad)
        slope = -2.0 * self.ovality * np.sin(2.0 * place_rad)
        speed = np.hypot(radius, slope)
        arc = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
        marked_rad = 2.0 * np.pi * arc / arc[-1] - np.pi
        turns = np.round(turn_rad / (2.0 * np.pi))
        rest_rad = turn_rad - 2.0 * np.pi * turns
        return np.asarray(CubicSpline(place_rad, marked_rad)(rest_rad)) + 2.0 * np.pi * turns
