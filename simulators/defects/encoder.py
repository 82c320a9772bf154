"""Mechanisms between a turning shaft and the number that its encoder gives; also those of a second encoder."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from simulators.defects.defect import ANY_INSTRUMENT, ROBOT, Defect, phase
from simulators.defects.scene import Scene, Site

Floats = NDArray[np.float64]
RADIUS_M = 0.02  # graduation of an encoder of 40 to 60 mm housing
GRID = 721  # half a degree: the trapezium rule on a periodic curve is exact far below 1e-9 rad


@dataclass(frozen=True)
class EncoderDefect(Defect):
    """Of the encoder of one joint; a member gives by how much it reads wrong."""

    joint: int

    PORT = "joint{joint}.angle"
    DRIVERS: ClassVar[tuple[str, ...]] = ("q{joint}",)
    INSTRUMENTS: ClassVar[tuple[str, ...]] = ANY_INSTRUMENT

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        """Reading less true angle of this joint, (row,), for shafts that truly stand at `shaft_rad` (row, n)."""
        raise NotImplementedError(type(self).__name__)

    def in_column_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        """The same as (row, n), zero at all other joints."""
        error_rad = np.zeros_like(shaft_rad)
        error_rad[:, self.joint - 1] = self.error_rad(shaft_rad, scene)
        return error_rad


class ControllerEncoderDefect(EncoderDefect):
    """Of the encoder that the controller reads."""

    def reading_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return self.in_column_rad(shaft_rad, scene)


class SecondEncoderDefect(EncoderDefect):
    """Of a second encoder: the controller's own reading is right, and so is the arm."""

    INSTRUMENTS = ()  # no instrument at the flange shows it

    def second_error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return self.in_column_rad(shaft_rad, scene)


@dataclass(frozen=True)
class Disc(EncoderDefect):
    """A disc `eccentricity_m` off its shaft, read by one head.

    The head stands at radius r from the shaft; the disc's centre is e off the shaft, at bearing b of the disc. Seen
    from the disc's centre the head stands at another angle than seen from the shaft, by atan2(e sin(q - b), r + e cos(q
    - b)): two points on a plane, exact for any e < r.
    """

    eccentricity_m: float
    bearing_rad: float
    radius_m: float = RADIUS_M

    PHYSICS = "encoder-eccentricity"
    SIZE = "eccentricity_m"
    TYPICAL = 2e-6  # 100 µrad at 20 mm

    @property
    def figures(self) -> dict[str, float]:
        return {"amplitude_rad": abs(self.eccentricity_m) / self.radius_m, "order": 1.0}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_size(rng), phase(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        turn_rad = shaft_rad[:, self.joint - 1] - self.bearing_rad
        aside_m = self.eccentricity_m * np.sin(turn_rad)
        return -np.arctan2(aside_m, self.radius_m + self.eccentricity_m * np.cos(turn_rad))


@dataclass(frozen=True)
class EccentricDisc(Disc, ControllerEncoderDefect):
    """The disc of the encoder that the controller reads."""

    KIND = "encoder-eccentricity"


@dataclass(frozen=True)
class SecondDisc(Disc, SecondEncoderDefect):
    """The disc of a second encoder."""

    KIND = "second-encoder-eccentricity"


@dataclass(frozen=True)
class OvalRing(ControllerEncoderDefect):
    """A ring that was pressed oval by `ovality` (largest radius over mean radius, less 1), read by one head.

    Radius r (1 + k cos 2(q - b)); marks keep their distance along the rim, so the angle per mark grows where the rim
    stands far out. The rim of a slightly oval ring is, to second order in k, marked at angle q + (k/2) sin 2(q - b);
    the reading here is the exact ratio of arc lengths, s(q)/s(2 pi), integrated on a fine grid. A ring that is held by
    three or four screws has as many `lobes` instead of two.
    """

    ovality: float
    bearing_rad: float
    lobes: int = 2

    KIND = "oval-ring"
    PHYSICS = "encoder-harmonic"
    SIZE = "ovality"
    TYPICAL = 1e-4  # 50 µrad

    @property
    def figures(self) -> dict[str, float]:
        return {"amplitude_rad": abs(self.ovality) / self.lobes, "order": float(self.lobes)}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_size(rng), phase(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        turn_rad = shaft_rad[:, self.joint - 1] - self.bearing_rad
        return self._marked_rad(turn_rad) - turn_rad

    def _marked_rad(self, turn_rad: Floats) -> Floats:
        """Angle that the marks give at true angle `turn_rad` (row,), continued beyond a turn."""
        place_rad = np.linspace(-np.pi, np.pi, GRID)
        radius = 1.0 + self.ovality * np.cos(self.lobes * place_rad)
        slope = -self.lobes * self.ovality * np.sin(self.lobes * place_rad)
        speed = np.hypot(radius, slope)
        arc = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
        marked_rad = 2.0 * np.pi * arc / arc[-1] - np.pi
        turns = np.round(turn_rad / (2.0 * np.pi))
        rest_rad = turn_rad - 2.0 * np.pi * turns
        return np.asarray(scipy.interpolate.CubicSpline(place_rad, marked_rad)(rest_rad)) + 2.0 * np.pi * turns


@dataclass(frozen=True)
class Slip(EncoderDefect):
    """A coupling that slips once: the encoder reads `slip_rad` more from `at_s` on."""

    slip_rad: float
    at_s: float

    PHYSICS = "encoder-slip"
    DRIVERS = ("t",)
    SIZE = "slip_rad"
    TYPICAL = 1e-4
    FIGURES = ("at_s", "step_rad=slip_rad")

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return np.where(scene.t_s >= self.at_s, self.slip_rad, 0.0)


@dataclass(frozen=True)
class EncoderSlip(Slip, ControllerEncoderDefect):
    """The coupling of the encoder that the controller reads."""

    KIND = "encoder-slip"

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_signed(rng), site.middle_s(rng))


@dataclass(frozen=True)
class SecondSlip(Slip, SecondEncoderDefect):
    """The coupling of a second encoder."""

    KIND = "second-encoder-slip"

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        sign = float(rng.choice([-1.0, 1.0]))
        at_s = site.middle_s(rng)
        return cls(site.any_joint(rng), cls.draw_size(rng) * sign, at_s)


@dataclass(frozen=True)
class SlowFilter(ControllerEncoderDefect):
    """A filter between encoder and controller: `missing` of the last move is still to go when it is read (no unit).

    First-order lag with time constant T after a ramp of duration D at constant speed: what is missing is
    move (T / D) (1 - exp(-D / T)) exp(-wait / T). Every move takes the same time.
    """

    missing: float

    KIND = "slow-filter"
    PHYSICS = "reading-lag"
    DRIVERS = ("last_move{joint}",)
    SIZE = "missing"
    TYPICAL = 3e-5
    INSTRUMENTS = ROBOT
    HABIT = "direct"
    FIGURES = ("slope=missing",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(site.any_joint(rng), cls.draw_size(rng))

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        return -self.missing * scene.last_move_rad[:, self.joint - 1]


@dataclass(frozen=True)
class StaleReading(ControllerEncoderDefect):
    """A controller that reports an older angle than the one it has: `missing` of what it still asks for (no unit).

    A first-order lag in a position loop at constant speed reads behind by a share of the following error.
    """

    missing: float

    KIND = "stale-reading"
    PHYSICS = "reading-lag"
    DRIVERS = ("cmd_minus_q{joint}",)
    SIZE = "missing"
    TYPICAL = 0.1
    INSTRUMENTS = ROBOT

    def error_rad(self, shaft_rad: Floats, scene: Scene) -> Floats:
        if scene.asked_rad is None:
            return np.zeros(len(shaft_rad))
        return -self.missing * scene.asked_rad[:, self.joint - 1]
