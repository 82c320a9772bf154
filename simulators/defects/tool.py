"""Mechanisms between the flange and the laser or target that it carries."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector, shifted, turned_about
from simulators.arm.statics import Load
from simulators.defects.defect import ROBOT, SPOTS, Defect, as_vector, direction
from simulators.defects.displacement import BriefShift, Bump, CarriedPart
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]
ORIGIN: Vector = (0.0, 0.0, 0.0)
TARGETS = ("position", "wire", "seat")


class MountDefect(Defect):
    """Of what carries the laser, or the point that is measured."""

    INSTRUMENTS = ROBOT
    at_laser: bool

    @property
    def port(self) -> str:
        return "laser.direction" if self.at_laser else "tool.point"


@dataclass(frozen=True)
class SaggingMount(MountDefect):
    """A mount at the flange that gives way: it leans by `lean_rad` towards where gravity pulls when its axis is level.

    Cantilever with its mass on the axis of the flange: the lean is across axis and gravity, in proportion to the part
    of gravity across the axis, about the foot of the mount, which stands at `foot_m` in the flange frame.
    """

    lean_rad: float
    axis: Vector
    at_laser: bool
    foot_m: Vector = ORIGIN

    KIND = "sagging-mount"
    PHYSICS = "tool-sag"
    DRIVERS = ("gravity_tool",)
    SIZE = "lean_rad"
    TYPICAL = 6e-5
    FIGURES = ("lean_rad",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        axis = np.array([0.0, 0.0, 1.0]) + 0.2 * rng.standard_normal(3)
        return cls(cls.draw_size(rng), as_vector(axis / np.linalg.norm(axis)), site.instrument == "dual-psd")

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        lean_rad = self.lean_rad * np.cross(np.asarray(self.axis), load.down_flange)
        return turned_about(np.asarray(self.foot_m), lean_rad)


@dataclass(frozen=True)
class ElasticMount(MountDefect):
    """A mount of any shape: it shifts and turns by a matrix times the direction of gravity in the flange frame.

    Hooke for a body on a spring: rows of `shift_m` and `turn_rad` are x, y, z of what one weight along x, y, z of the
    flange does, at the point `at_m`.
    """

    shift_m: tuple[Vector, Vector, Vector]
    turn_rad: tuple[Vector, Vector, Vector]
    at_m: Vector
    at_laser: bool
    share: float = 1.0

    KIND = "elastic-mount"
    PHYSICS = "tool-sag"
    DRIVERS = ("gravity_tool",)

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        down = self.share * load.down_flange
        turned = turned_about(np.asarray(self.at_m), down @ np.asarray(self.turn_rad).T)
        return shifted(down @ np.asarray(self.shift_m).T) @ turned


@dataclass(frozen=True)
class LaserWarmUp(Defect):
    """A laser diode that has just been switched on: its beam turns by `turn_rad` until it is warm.

    Body of one thermal mass: the turn is `turn_rad` (1 - exp(-t / time_constant)) about a fixed axis of the housing,
    which passes through `at_m` of the flange frame.
    """

    turn_rad: float
    time_constant_s: float
    axis: Vector
    at_m: Vector = ORIGIN
    start_s: float = 0.0

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
        warm = 1.0 - np.exp(-(scene.t_s - self.start_s) / self.time_constant_s)
        return turned_about(np.asarray(self.at_m), self.turn_rad * warm[:, np.newaxis] * np.asarray(self.axis))


@dataclass(frozen=True)
class WarmLaser(Defect):
    """A laser module whose beam turns by `turn_rad_k` per kelvin."""

    turn_rad_k: float
    axis: Vector
    at_m: Vector = ORIGIN  # a point of that axis in the flange frame
    where: str = "laser"  # the thermometer

    KIND = "warm-laser"
    PHYSICS = "laser-thermal-drift"
    PORT = "laser.direction"
    DRIVERS = ("temp_laser",)
    SIZE = "turn_rad_k"
    TYPICAL = 6e-6  # 2 to 12 µrad/K
    INSTRUMENTS = SPOTS
    NEEDS = ("temp_laser_degC",)
    FIGURES = ("slope_rad_k=turn_rad_k",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), direction(rng))

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        turn_rad = self.turn_rad_k * scene.warmed_k(self.where)[:, np.newaxis] * np.asarray(self.axis)
        return turned_about(np.asarray(self.at_m), turn_rad)


class _CarriedOnFlange(CarriedPart):
    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return self.carried(scene)


@dataclass(frozen=True)
class CarriedLaser(_CarriedOnFlange):
    """The laser in its mount, in the flange frame."""

    KIND = "carried-laser"
    PHYSICS = "laser-warm-up"
    PORT = "laser.origin"
    INSTRUMENTS = SPOTS


@dataclass(frozen=True)
class CarriedTarget(_CarriedOnFlange):
    """The target in its nest, in the flange frame."""

    KIND = "carried-target"
    PHYSICS = "tool-moved"
    PORT = "tool.point"
    INSTRUMENTS = TARGETS


class _Reseated(Bump):
    ASKED = True

    def tool_motion(self, scene: Scene, load: Load) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class ReseatedTarget(_Reseated):
    """A reflector or probe that was taken off and put on again, with a grain of dust below it."""

    KIND = "reseated-target"
    PHYSICS = "tool-moved"
    PORT = "tool.point"
    TYPICAL = 5e-5
    TURNS_RAD_M = (0.0, 0.0)  # of a point no turn is seen
    INSTRUMENTS = TARGETS


@dataclass(frozen=True)
class ReseatedLaser(_Reseated):
    """A laser that was unscrewed, or knocked, and points along another line from then on."""

    KIND = "reseated-laser"
    PHYSICS = "laser-moved"
    PORT = "laser.direction"
    TYPICAL = 4e-5
    TURNS_RAD_M = (1.0, 4.0)
    INSTRUMENTS = SPOTS


@dataclass(frozen=True)
class BrieflyShiftedLaser(BriefShift, ReseatedLaser):
    """A laser that a cable pulled aside for a while."""

    KIND = "briefly-shifted-laser"
