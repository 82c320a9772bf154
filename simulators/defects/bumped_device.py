"""A tripod that was knocked: from one moment on the device stands elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import moved
from simulators.defects.directions import Vector, direction, spread
from simulators.defects.scene import Scene
from simulators.defects.site import Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BumpedDevice:
    """Device that moves by `shift_m` at `at_s`."""

    shift_m: float
    along: Vector
    turn_rad_m: float
    about: Vector
    at_s: float

    KIND: ClassVar[str] = "bumped-device"
    PHYSICS: ClassVar[str] = "device-drift"
    SIZE: ClassVar[str] = "shift_m"
    TYPICAL: ClassVar[float] = 5e-5
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ("position", "wire")
    HABIT: ClassVar[str] = ""

    @property
    def port(self) -> str:
        return "device.pose"

    @property
    def drivers(self) -> tuple[str, ...]:
        return ("t",)

    @property
    def needs(self) -> tuple[str, ...]:
        return ()

    @property
    def figures(self) -> Mapping[str, float]:
        return {"at_s": self.at_s, "shift_m": self.shift_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = float(rng.uniform(0.25, 0.75) * site.duration_s)
        return cls(spread(rng, cls.TYPICAL), direction(rng), float(rng.uniform(0.1, 0.6)), direction(rng), at_s)

    def device_motion(self, scene: Scene) -> Floats:
        gone_m = np.where(scene.t_s >= self.at_s, self.shift_m, 0.0)[:, np.newaxis]
        return moved(gone_m * np.asarray(self.along), self.turn_rad_m * gone_m * np.asarray(self.about))
