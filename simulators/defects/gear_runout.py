"""A gear whose wheel runs out: once per turn of the pinion the output leads and lags, and a little at twice that.

The pinion of pitch radius r runs e off its axis; the wheel is driven by the place where the teeth meet, so the output
is off by e sin(N q - b) / R, with N the gear ratio and R the wheel's pitch radius (Munro, "A review of the theory and
measurement of gear transmission error", IMechE 1990: long-wave part). The second tooth flank adds `second` of it at 2
N.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.directions import ROBOT, phase, spread
from simulators.defects.scene import Load, Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class GearRunout:
    """Drive of one joint, its pinion `runout_m` off its axis."""

    joint: int
    runout_m: float
    ratio: float
    second: float
    bearing_rad: float
    wheel_radius_m: float = 0.05

    KIND: ClassVar[str] = "gear-runout"
    PHYSICS: ClassVar[str] = "gear-transmission-error"
    SIZE: ClassVar[str] = "runout_m"
    TYPICAL: ClassVar[float] = 2.5e-6  # 50 urad at 50 mm
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ROBOT
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return f"joint{self.joint}.angle"

    @property
    def drivers(self) -> tuple[str, ...]:
        return (f"q{self.joint}",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ("gear_ratio",)

    @property
    def figures(self) -> Mapping[str, float]:
        return {"amplitude_rad": abs(self.runout_m) / self.wheel_radius_m, "order": self.ratio}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        joint = site.geared_joint(rng)
        ratio = site.gear_ratio[joint - 1]
        return cls(joint, spread(rng, cls.TYPICAL), ratio, float(rng.choice([0.0, 0.3])), phase(rng))

    def extra_turn_rad(self, shaft_rad: Floats, scene: Scene, load: Load) -> Floats:
        extra_rad = np.zeros_like(shaft_rad)
        pinion_rad = self.ratio * shaft_rad[:, self.joint - 1] - self.bearing_rad
        lead_m = self.runout_m * (np.sin(pinion_rad) + self.second * np.sin(2.0 * pinion_rad + 1.0))
        extra_rad[:, self.joint - 1] = lead_m / self.wheel_radius_m
        return extra_rad
