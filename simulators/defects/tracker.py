"""Mechanisms of trackers and wire drums: under the device, and between target and reading."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import Defect, phase
from simulators.defects.displacement import Bump, Settling
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BumpedDevice(Bump):
    """A tripod that was knocked."""

    KIND = "bumped-device"
    PHYSICS = "device-drift"
    PORT = "device.pose"
    TYPICAL = 5e-5
    TURNS_RAD_M = (0.1, 0.6)
    INSTRUMENTS = ("position", "wire")

    def device_motion(self, scene: Scene) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class DriftingDevice(Settling):
    """A tripod that settles."""

    KIND = "drifting-device"
    PHYSICS = "device-drift"
    PORT = "device.pose"
    TYPICAL = 5e-5
    TURNS_RAD_M = (0.1, 0.6)
    INSTRUMENTS = ("position", "wire")

    def device_motion(self, scene: Scene) -> Floats:
        return self.motion(scene)


@dataclass(frozen=True)
class LengthScale(Defect):
    """A device that gives every length `excess` too long (no unit)."""

    excess: float

    PHYSICS = "device-scale"
    PORT = "device.reading"
    DRIVERS = ("reading",)
    SIZE = "excess"

    @property
    def figures(self) -> dict[str, float]:
        return {"scale": self.excess}

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
    second part.
    """

    offset_m: float
    radius_m: float
    bearing_rad: float

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
        turn_rad = length_m / self.radius_m
        return length_m - self.offset_m * (np.sin(turn_rad + self.bearing_rad) - np.sin(self.bearing_rad))
