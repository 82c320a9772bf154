"""Mechanisms under the arm."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import turned
from simulators.arm.statics import Load
from simulators.defects.defect import ANY_INSTRUMENT, ROBOT, Defect, UnderWeights
from simulators.defects.displacement import BriefShift, Bump, CarriedPart, Displacement, Settling
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


class _MovedBase(Displacement):
    PHYSICS = "base-moved"
    PORT = "base.pose"
    TURNS_RAD_M = (0.3, 1.5)
    INSTRUMENTS = ("dual-psd", "seat")

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class BumpedBase(_MovedBase, Bump):
    """A foot that was knocked."""

    KIND = "bumped-base"
    TYPICAL = 4e-5


@dataclass(frozen=True)
class BrieflyShiftedBase(_MovedBase, BriefShift):
    """A foot on which somebody leaned for a while."""

    KIND = "briefly-shifted-base"
    TYPICAL = 5e-5


@dataclass(frozen=True)
class DriftingBase(_MovedBase, Settling):
    """A table or a foot that settles."""

    KIND = "drifting-base"
    TYPICAL = 5e-5


class _Pedestal(Defect):
    PHYSICS = "base-compliance"
    PORT = "base.pose"
    DRIVERS = ("overturning_moment",)
    INSTRUMENTS = ROBOT


@dataclass(frozen=True)
class SoftPedestal(_Pedestal):
    """A pedestal that leans `compliance_rad_nm` per newton metre of the arm's overturning moment.

    A spring against tilting in two directions: tilt = moment / stiffness, about the foot. Twisting about the vertical
    carries no weight and stays.
    """

    compliance_rad_nm: float

    KIND = "soft-pedestal"
    SIZE = "compliance_rad_nm"
    TYPICAL = 2e-6
    FIGURES = ("compliance_rad_nm",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng))

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        return turned(self.compliance_rad_nm * load.moment_nm[:, 0] * np.array([1.0, 1.0, 0.0]))


@dataclass(frozen=True)
class UnevenPedestal(_Pedestal):
    """A pedestal that leans more about one level axis than about the other: a spring for each."""

    about_x_rad_nm: float
    about_y_rad_nm: float
    share: float = 1.0

    KIND = "uneven-pedestal"

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        gives = np.array([self.about_x_rad_nm, self.about_y_rad_nm, 0.0])
        return turned(self.share * load.moment_nm[:, 0] * gives)


@dataclass(frozen=True)
class PedestalUnderWeights(UnderWeights, _Pedestal):
    """A soft pedestal under other weights than the stated masses."""

    KIND = "pedestal-under-weights"

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        moment, _ = self.felt(scene, load, 0)
        return turned(self.share * moment * np.array([1.0, 1.0, 0.0]))


@dataclass(frozen=True)
class CarriedBase(CarriedPart):
    """The arm's foot, in the base frame."""

    KIND = "carried-base"
    PHYSICS = "base-moved"
    PORT = "base.pose"
    INSTRUMENTS = ANY_INSTRUMENT

    def base_motion(self, scene: Scene, load: Load) -> Floats:
        return self.carried(scene)
