"""Mechanisms of trackers and wire drums: under the device, and between target and reading."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from simulators.arm.kinematics import turned
from simulators.defects.defect import Defect, phase
from simulators.defects.displacement import Bump, CarriedPart, Displacement, Settling
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


class _MovedDevice(Displacement):
    PHYSICS = "device-drift"
    PORT = "device.pose"
    TYPICAL = 5e-5
    TURNS_RAD_M = (0.1, 0.6)
    INSTRUMENTS = ("position", "wire")

    def device_motion(self, scene: Scene) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class BumpedDevice(_MovedDevice, Bump):
    """A tripod that was knocked."""

    KIND = "bumped-device"


@dataclass(frozen=True)
class DriftingDevice(_MovedDevice, Settling):
    """A tripod that settles."""

    KIND = "drifting-device"


@dataclass(frozen=True)
class LengthScale(Defect):
    """A device that gives every length `excess` too long (no unit)."""

    excess: float

    PHYSICS = "device-scale"
    PORT = "device.reading"
    DRIVERS = ("reading",)
    SIZE = "excess"
    FIGURES = ("scale=excess",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_signed(rng))


@dataclass(frozen=True)
class TrackerScale(LengthScale):
    """A tracker with another wavelength of its laser, or with the wrong air pressure."""

    KIND = "tracker-scale"
    TYPICAL = 5e-5
    INSTRUMENTS = ("position",)

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        return position_m * (1.0 + self.excess)


@dataclass(frozen=True)
class WireScale(LengthScale):
    """A wire drum whose circumference is off."""

    KIND = "wire-scale"
    TYPICAL = 3e-4
    INSTRUMENTS = ("wire",)

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        return length_m * (1.0 + self.excess)


@dataclass(frozen=True)
class DrumOutOfRound(Defect):
    """A wire drum whose centre is `offset_m` off its shaft: each turn pays out a little more and a little less.

    A drum of radius R whose centre is e off its shaft pays out, over a turn from angle a, R a + e (sin(a + b) - sin b)
    (length of an off-centre circle to first order in e / R); the encoder counts turns, so the reading is off by that
    second part. The counter is set at the length `set_at_m`.
    """

    offset_m: float
    radius_m: float
    bearing_rad: float
    set_at_m: float = 0.0

    KIND = "wire-drum-out-of-round"
    PHYSICS = "device-periodic"
    PORT = "device.reading"
    DRIVERS = ("reading",)
    SIZE = "offset_m"
    TYPICAL = 4e-5
    INSTRUMENTS = ("wire",)

    @property
    def figures(self) -> dict[str, float]:
        return {"amplitude_m": abs(self.offset_m), "period_m": 2.0 * np.pi * self.radius_m}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(cls.draw_size(rng), float(rng.uniform(0.03, 0.06)), phase(rng))

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        turn_rad = length_m / self.radius_m + self.bearing_rad
        set_rad = self.set_at_m / self.radius_m + self.bearing_rad
        return length_m - self.offset_m * (np.sin(turn_rad) - np.sin(set_rad))


@dataclass(frozen=True)
class CarriedDevice(CarriedPart):
    """A tripod, in the device's frame."""

    KIND = "carried-device"
    PHYSICS = "device-drift"
    PORT = "device.pose"
    INSTRUMENTS = ("position", "wire")

    def device_motion(self, scene: Scene) -> Floats:
        return self.carried(scene)


@dataclass(frozen=True)
class ChangingScale(Defect):
    """A scale that changes with range or temperature: a length L is given L (1 + a L + b L^2 + c (T - T0)).

    Air whose index changes along the beam, a wire that sags under its own weight or grows with its temperature.
    """

    per_m: float = 0.0
    per_m2: float = 0.0
    per_k: float = 0.0
    where: str = "room"
    share: float = 1.0

    KIND = "changing-scale"
    PHYSICS = "device-scale"
    PORT = "device.reading"
    DRIVERS = ("reading",)
    INSTRUMENTS = ("position", "wire")

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        return position_m * self._scale(np.linalg.norm(position_m, axis=1), scene)[:, np.newaxis]

    def seen_length_m(self, length_m: Floats, scene: Scene) -> Floats:
        return length_m * self._scale(length_m, scene)

    def _scale(self, length_m: Floats, scene: Scene) -> Floats:
        warmed = self.per_k * scene.warmed_k(self.where) if self.per_k else 0.0
        return 1.0 + self.share * (self.per_m * length_m + self.per_m2 * length_m**2 + warmed)


@dataclass(frozen=True)
class CircleOffCentre(Defect):
    """A graduated circle of a tracker that is off its axis (once a turn) or oval (twice): its angle runs wrong.

    The head turns about z for the azimuth and about its level axis for the elevation; the angle is given
    `amplitude_rad` sin(`order` angle + `phase_rad`) too large.
    """

    circle: Literal["azimuth", "elevation"]
    order: int
    amplitude_rad: float
    phase_rad: float

    KIND = "tracker-circle"
    PHYSICS = "device-periodic"
    PORT = "device.reading"
    DRIVERS = ("reading",)
    SIZE = "amplitude_rad"
    TYPICAL = 2e-5
    INSTRUMENTS = ("position",)

    def seen_position_m(self, position_m: Floats, scene: Scene) -> Floats:
        x, y, z = position_m.T
        level_m, zero = np.hypot(x, y), np.zeros_like(x)
        if self.circle == "azimuth":
            angle_rad, axis = np.arctan2(y, x), np.stack((zero, zero, zero + 1.0), axis=1)
        else:
            angle_rad = np.arctan2(z, level_m)
            axis = np.stack((y, -x, zero), axis=1) / np.maximum(level_m, 1e-9)[:, np.newaxis]
        wrong_rad = self.amplitude_rad * np.sin(self.order * angle_rad + self.phase_rad)
        return np.einsum("rij,rj->ri", turned(wrong_rad[:, np.newaxis] * axis)[:, :3, :3], position_m)
