"""Mechanisms between the flange and the laser or target that it carries."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.rigid import Vector, turned
from simulators.arm.statics import Load
from simulators.defects.defect import ROBOT, SPOTS, Defect, as_vector, direction
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SaggingMount(Defect):
    """A mount at the flange that gives way: it leans by `lean_rad` towards where gravity pulls when its axis is level.

    Cantilever with its mass on the axis of the flange: the lean is across axis and gravity, in proportion to the part
    of gravity across the axis, about the foot of the mount.
    """

    lean_rad: float
    axis: Vector
    at_laser: bool

    KIND = "sagging-mount"
    PHYSICS = "tool-sag"
    DRIVERS = ("gravity_tool",)
    SIZE = "lean_rad"
    TYPICAL = 6e-5
    INSTRUMENTS = ROBOT
    FIGURES = ("lean_rad",)

    @property
    def port(self) -> str:
        return "laser.direction" if self.at_laser else "tool.point"

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        axis = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal(3)
        return cls(cls.draw_size(rng), as_vector(axis / np.linalg.norm(axis)), site.instrument == "dual-psd")

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.lean_rad * np.cross(np.asarray(self.axis), load.down_flange))


@dataclass(frozen=True)
class LaserWarmUp(Defect):
    """A laser diode that has just been switched on: its beam turns by `turn_rad` until it is warm.

    Body of one thermal mass: the turn is `turn_rad` (1 - exp(-t / time_constant)) about a fixed axis of the housing.
    """

    turn_rad: float
    time_constant_s: float
    axis: Vector

    KIND = "laser-warm-up"
    PHYSICS = "laser-warm-up"
    PORT = "laser.direction"
    DRIVERS = ("t",)
    SIZE = "turn_rad"
    TYPICAL = 3e-5
    INSTRUMENTS = SPOTS
    FIGURES = ("turn_rad", "time_constant_s")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), float(rng.uniform(0.05, 0.25) * site.duration_s), direction(rng))

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        warm = 1.0 - np.exp(-scene.t_s / self.time_constant_s)
        return turned(self.turn_rad * warm[:, np.newaxis] * np.asarray(self.axis))


@dataclass(frozen=True)
class WarmLaser(Defect):
    """A laser module whose beam turns by `turn_rad_k` per kelvin."""

    turn_rad_k: float
    axis: Vector

    KIND = "warm-laser"
    PHYSICS = "laser-thermal-drift"
    PORT = "laser.direction"
    DRIVERS = ("temp_laser",)
    SIZE = "turn_rad_k"
    TYPICAL = 6e-6  # 2 to 12 urad/K
    INSTRUMENTS = SPOTS
    NEEDS = ("temp_laser_degC",)

    @property
    def figures(self) -> dict[str, float]:
        return {"slope_rad_k": self.turn_rad_k}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), direction(rng))

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.turn_rad_k * scene.warmed_k("laser")[:, np.newaxis] * np.asarray(self.axis))
