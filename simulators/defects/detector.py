"""Mechanisms between the light on a PSD and the position that it gives."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from simulators.defects.defect import SPOTS, Defect, phase
from simulators.defects.scene import Light, Scene, Site

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PsdDefect(Defect):
    """Of one of the two PSDs; a member says where that one sees the spot."""

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

    @property
    def figures(self) -> dict[str, float]:
        return {"edge_share": self.distortion}

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

    @property
    def figures(self) -> dict[str, float]:
        return {"quadratic": self.bow}

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

    @property
    def figures(self) -> dict[str, float]:
        return {"cross": self.skew}

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
    hour_s: float

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
