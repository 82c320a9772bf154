"""Mechanisms between the light on a PSD and the position that it gives."""

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import SPOTS, UNKNOWN, Defect, phase
from simulators.defects.scene import Light, Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PsdDefect(Defect):
    """Of one of the two PSDs; a member gives where that one sees the spot."""

    psd: int

    PORT = "psd{psd}.reading"
    DRIVERS: ClassVar[tuple[str, ...]] = ("spot{psd}",)
    INSTRUMENTS = SPOTS

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        """Spot (row, 2) as this PSD gives it when it is truly at `own_m` (row, 2)."""
        raise NotImplementedError(type(self).__name__)

    def seen_spots_m(self, spot_m: Floats, light: Light, scene: Scene) -> Floats:
        seen_m = spot_m.copy()
        seen_m[:, self.psd - 1] = self.seen_m(spot_m[:, self.psd - 1], light, scene)
        return seen_m


def either_psd(rng: np.random.Generator) -> int:
    """1 or 2."""
    return int(rng.integers(1, 3))


@dataclass(frozen=True)
class Pincushion(PsdDefect):
    """Lines of equal position that bow: spots at the edge are given `distortion` too far out (no unit).

    r' = r (1 + k r^2 / H^2), H half the face: the third-order term of a resistive-layer PSD (Wang and Busch-Vishniac,
    "The linearity and sensitivity of lateral effect PSDs", IEEE Trans. Electron Devices 36 (1989) 2475).
    """

    distortion: float
    half_size_m: float

    KIND = "psd-pincushion"
    PHYSICS = "psd-nonlinearity"
    SIZE = "distortion"
    TYPICAL = 3e-3
    FIGURES = ("edge_share=distortion",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(either_psd(rng), cls.draw_size(rng), site.half_size_m)

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        out = np.sum(own_m**2, axis=1, keepdims=True) / self.half_size_m**2
        return own_m * (1.0 + self.distortion * out)


@dataclass(frozen=True)
class BowedScale(PsdDefect):
    """A resistive layer that thickens towards one edge: the scale is off by `bow` there (no unit).

    x' = x + k (x^2 / H) along one direction of the face: the first uneven term of a layer whose sheet resistance has a
    slope.
    """

    bow: float
    towards_rad: float
    half_size_m: float

    KIND = "psd-bowed"
    PHYSICS = "psd-nonlinearity"
    SIZE = "bow"
    TYPICAL = 3e-3
    FIGURES = ("quadratic=bow",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(either_psd(rng), cls.draw_size(rng), phase(rng), site.half_size_m)

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        along = np.array([np.cos(self.towards_rad), np.sin(self.towards_rad)])
        far_m = own_m @ along
        return own_m + (self.bow * far_m**2 / self.half_size_m)[:, np.newaxis] * along


@dataclass(frozen=True)
class WrongGain(PsdDefect):
    """A scale that is off: amplifier gains and resistances give another length per volt in x and in y.

    The PSD gives `excess` too much along y and `x_share` of that along x (no unit).
    """

    excess: float
    x_share: float

    KIND = "psd-gain"
    PHYSICS = "psd-gain"
    SIZE = "excess"
    TYPICAL = 2e-3

    @property
    def figures(self) -> dict[str, float]:
        return {"gain_x_error_share": self.excess * self.x_share, "gain_y_error_share": self.excess}

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(either_psd(rng), cls.draw_size(rng), float(rng.uniform(-1.0, 1.0)))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        return own_m * np.array([1.0 + self.excess * self.x_share, 1.0 + self.excess])


@dataclass(frozen=True)
class SkewedElectrodes(PsdDefect):
    """Electrodes that are not square to each other: `skew` of a spot's y shows in its x (rad)."""

    skew: float

    KIND = "psd-skewed"
    PHYSICS = "psd-gain"
    SIZE = "skew"
    TYPICAL = 2e-3
    FIGURES = ("cross=skew",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(either_psd(rng), cls.draw_signed(rng))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        return np.stack((own_m[:, 0] + self.skew * own_m[:, 1], own_m[:, 1]), axis=1)


@dataclass(frozen=True)
class StrayLight(PsdDefect):
    """Room light of `stray_v` that falls at `centre_m`: the reading is drawn there, the more the weaker the laser is.

    A PSD gives the centre of all its light: (S x + A o) / (S + A), with S and A the sum signals of laser and room and o
    the centre of the room's light. A window lets A change with the hour; the sum signal shows S + A.
    """

    stray_v: float
    centre_m: tuple[float, float]
    hour_s: float = math.inf  # in which it waxes and wanes; infinite: a lamp

    KIND = "psd-stray-light"
    PHYSICS = "psd-ambient-light"
    DRIVERS = ("psd{psd}_sum",)
    SIZE = "stray_v"
    TYPICAL = 0.02
    NEEDS = ("psd{psd}_sum_v",)
    FIGURES = ("stray_v",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        x_m, y_m = (float(value) for value in 0.7 * site.half_size_m * rng.uniform(-1.0, 1.0, 2))
        psd, stray_v = either_psd(rng), cls.draw_size(rng)
        return cls(psd, stray_v, (x_m, y_m), float(rng.uniform(0.3, 1.0) * site.duration_s))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        laser_v, stray_v = light.sum_v[:, self.psd - 1, np.newaxis], self._stray_v(scene)[:, np.newaxis]
        return (laser_v * own_m + stray_v * np.asarray(self.centre_m)) / (laser_v + stray_v)

    def seen_sum_v(self, sum_v: Floats, scene: Scene) -> Floats:
        seen_v = sum_v.copy()
        seen_v[:, self.psd - 1] += self._stray_v(scene)
        return seen_v

    def _stray_v(self, scene: Scene) -> Floats:
        return self.stray_v * (1.0 + 0.6 * np.sin(2.0 * np.pi * scene.t_s / self.hour_s))


@dataclass(frozen=True)
class CoverGlass(PsdDefect):
    """A cover glass of `thickness_m`: a slanting beam is shifted sideways on its way through.

    A plate of thickness t and index n right above the face moves the spot against the beam's slant by t (tan i - tan
    r), sin r = sin i / n (Snell; Hecht, "Optics", section 4.4). The plate's own reflections are left out.
    """

    thickness_m: float
    index: float = 1.52  # borosilicate at 635 nm

    KIND = "psd-glass"
    PHYSICS = "psd-cover-glass"
    DRIVERS = ("incidence{psd}",)
    SIZE = "thickness_m"
    TYPICAL = 5e-4
    FIGURES = ("thickness_m",)

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        return cls(either_psd(rng), cls.draw_size(rng))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        beam = light.direction[:, self.psd - 1]
        sine = np.hypot(beam[:, 0], beam[:, 1])
        inside = sine / self.index
        shift_m = self.thickness_m * (sine / np.sqrt(1.0 - sine**2) - inside / np.sqrt(1.0 - inside**2))
        return own_m - shift_m[:, np.newaxis] * beam[:, :2] / np.maximum(sine, 1e-12)[:, np.newaxis]


@dataclass(frozen=True)
class SpottedFace(PsdDefect):
    """A burn or a grain of dust on a face: around `centre_m` readings are off by up to `height_m` along a line.

    The light that the spot swallows moves the centre of what is left; a round bell of width `width_m` (one sigma) in
    the place on the face.
    """

    height_m: float
    centre_m: tuple[float, float]
    width_m: float
    towards_rad: float

    KIND = "psd-spot"
    PHYSICS = "psd-local-defect"
    SIZE = "height_m"
    TYPICAL = 2e-5
    FIGURES = ("height_m", "width_m")

    @classmethod
    def draw(cls, rng: np.random.Generator, site: Site) -> Self:
        x_m, y_m = (float(value) for value in 0.5 * site.half_size_m * rng.uniform(-1.0, 1.0, 2))
        width_m = float(rng.uniform(0.15, 0.35) * site.half_size_m)
        return cls(either_psd(rng), cls.draw_size(rng), (x_m, y_m), width_m, phase(rng))

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        far = np.sum((own_m - np.asarray(self.centre_m)) ** 2, axis=1, keepdims=True) / self.width_m**2
        along = np.array([np.cos(self.towards_rad), np.sin(self.towards_rad)])
        return own_m + self.height_m * np.exp(-0.5 * far) * along


@dataclass(frozen=True)
class StrainedFace(PsdDefect):
    """A face whose picture is strained like a sheet of rubber: `x` and `y` too long, and sheared by `shear` (no unit).

    Plane strain: x' = (1 + x) x + (shear / 2) y, y' = (1 + y) y + (shear / 2) x. Electrodes that are not square to each
    other shear it; what is left is a turn of the whole detector.
    """

    x: float
    y: float
    shear: float
    share: float = 1.0

    KIND = "psd-strained"
    PHYSICS = "psd-gain"

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        half = 0.5 * self.shear
        return own_m + self.share * own_m @ np.array([[self.x, half], [half, self.y]])


@dataclass(frozen=True)
class UnevenLayer(PsdDefect):
    """A resistive layer of uneven thickness, expanded in powers of the place on the face.

    Each of `powers` is (0 for x or 1 for y, i, j, share): the reading there is off by share H (x / H)^i (y / H)^j with
    H half the face, so `share` is the error at the edge over half the face.
    """

    powers: tuple[tuple[int, int, int, float], ...]
    half_size_m: float
    share: float = 1.0

    KIND = "psd-uneven-layer"
    PHYSICS = "psd-nonlinearity"

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        x, y = (own_m / self.half_size_m).T
        seen_m = own_m.copy()
        for axis, i, j, size in self.powers:
            seen_m[:, axis] += self.share * size * self.half_size_m * x**i * y**j
        return seen_m


@dataclass(frozen=True)
class WavesOnFace(PsdDefect):
    """Waves across a face, as a window or strips of a worn layer make them: x and y each with amplitude and phase."""

    amplitude_m: tuple[float, float]
    phase_rad: tuple[float, float]
    waves_per_m: tuple[float, float]
    share: float = 1.0

    KIND = "psd-waves"
    PHYSICS = UNKNOWN

    def seen_m(self, own_m: Floats, light: Light, scene: Scene) -> Floats:
        turn_rad = 2.0 * np.pi * (own_m @ np.asarray(self.waves_per_m))
        waves = np.sin(turn_rad[:, np.newaxis] + np.asarray(self.phase_rad))
        return own_m + self.share * np.asarray(self.amplitude_m) * waves
