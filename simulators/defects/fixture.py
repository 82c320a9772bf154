"""Mechanisms under what the arm is measured against: the dual-PSD fixture and the cones."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import Vector
from simulators.defects.defect import SPOTS, Defect, direction
from simulators.defects.displacement import BriefShift, Bump, CarriedPart
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BumpedFixture(BriefShift):
    """A fixture that was knocked at a place: it moves by `shift_m` at `at_s`, until it leaves that place.

    It also turns about `turn_rad_m` for each metre.
    """

    place: int

    KIND = "bumped-fixture"
    PHYSICS = "fixture-moved"
    PORT = "fixture.pose"
    TYPICAL = 3e-5
    TURNS_RAD_M = (0.0, 3.0)
    INSTRUMENTS = SPOTS
    FIGURES = ("at_s", "placement=place", "shift_m")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        place = int(rng.choice(site.places))
        at_s, until_s = site.stay_s(place, rng)
        return cls(*cls._draw_way(rng), at_s, until_s, place)

    def gone_m(self, scene: Scene) -> Floats:
        return np.where(scene.placement == self.place, super().gone_m(scene), 0.0)

    def fixture_motion(self, scene: Scene) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class MovedCone(Defect):
    """A cone that was pushed by `shift_m` at `at_s`."""

    cone: int
    shift_m: float
    along: Vector
    at_s: float

    KIND = "moved-cone"
    PHYSICS = "seat-moved"
    PORT = "seat.position"
    DRIVERS = ("t",)
    SIZE = "shift_m"
    TYPICAL = 4e-5
    INSTRUMENTS = ("seat",)
    FIGURES = ("at_s", "seat=cone", "shift_m")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        at_s = site.middle_s(rng)
        return cls(int(rng.choice(site.seats)), cls.draw_size(rng), direction(rng), at_s)

    def seat_shift_m(self, scene: Scene) -> Floats:
        pushed = (scene.seat == self.cone) & (scene.t_s >= self.at_s)
        return np.where(pushed, self.shift_m, 0.0)[:, np.newaxis] * np.asarray(self.along)


@dataclass(frozen=True)
class CarriedFixture(CarriedPart):
    """The fixture while it stands at a place, and until it is taken away there, in the frame of PSD 1."""

    place: int = 1
    until_s: float = np.inf

    KIND = "carried-fixture"
    PHYSICS = "fixture-moved"
    PORT = "fixture.pose"
    INSTRUMENTS = SPOTS

    def fixture_motion(self, scene: Scene) -> Floats:
        return self.carried_where((scene.placement == self.place) & (scene.t_s < self.until_s), scene)


@dataclass(frozen=True)
class CarriedTable(CarriedPart):
    """The table with all stations of the fixture, in the base frame."""

    KIND = "carried-table"
    PHYSICS = "fixture-moved"
    PORT = "fixture*.pose"
    INSTRUMENTS = SPOTS

    def stations_motion(self, scene: Scene) -> Floats:
        return self.carried_where(scene.placement > 0, scene)


@dataclass(frozen=True)
class CarriedCones(CarriedPart):
    """The plate with all cones, or one of them (`cone`; 0: all), in the base frame."""

    cone: int = 0

    KIND = "carried-cones"
    PHYSICS = "seat-moved"
    PORT = "seat*.position"
    INSTRUMENTS = ("seat",)

    def stations_motion(self, scene: Scene) -> Floats:
        return self.carried_where(scene.seat == self.cone if self.cone else scene.seat > 0, scene)


class _AllStations(Bump):
    TYPICAL = 4e-5
    TURNS_RAD_M = (0.3, 1.5)

    def stations_motion(self, scene: Scene) -> Floats:
        """Motion (row, 4, 4) in the base frame of all that the arm is measured against."""
        return self.motion(scene)


@dataclass(frozen=True)
class KnockedTable(_AllStations):
    """The table with all stations of the fixture was knocked: from `at_s` on they stand elsewhere, as one body."""

    KIND = "knocked-table"
    PHYSICS = "fixture-moved"
    PORT = "fixture*.pose"
    INSTRUMENTS = SPOTS
    HABIT = "in turns"


@dataclass(frozen=True)
class KnockedPlate(_AllStations):
    """The plate with all cones was knocked: from `at_s` on they stand elsewhere, as one body."""

    KIND = "knocked-plate"
    PHYSICS = "seat-moved"
    PORT = "seat*.position"
    INSTRUMENTS = ("seat",)
