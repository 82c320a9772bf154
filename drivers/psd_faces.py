"""From the currents of one face of a position-sensitive detector to spot, light and uncertainty.

A face is one kind of electrode layout: how its four currents make two differences over two sums, and how such a ratio
reads in metres. The next kind is its row in KINDS.

Sources: duo-lateral: On-Trak Photonics, "PSD theory". Tetra-lateral and pin-cushion: Hamamatsu, "Characteristics and
use of PSD" (KPSD 0001), formulas (3-3) to (3-6). Quadrant: light exp(-2 r^2 / w^2) integrated over both halves of the
face gives (right - left) / sum = erf(sqrt(2) x / w), w the spot's radius at 1/e^2, while the whole spot is on the face.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import erfinv

Floats = NDArray[np.float64]


class FaceKind(IntEnum):
    """Electrode layout; the numbers are those of the DAQ protocol."""

    DUO_LATERAL = 1
    TETRA_LATERAL = 2
    QUADRANT = 3
    PIN_CUSHION = 4


@dataclass(frozen=True)
class Reading:
    """A spot on one face, each of shape (...): one for every set of four currents."""

    x_m: Floats
    y_m: Floats
    sum_a: Floats  # the photocurrent


@dataclass(frozen=True)
class MeanReading:
    """The spot of averaged currents, with the standard deviation of the mean from the scatter of the samples."""

    x_m: float
    y_m: float
    sum_a: float
    x_sigma_m: float
    y_sigma_m: float
    samples: int


@dataclass(frozen=True)
class _Ratios:
    """Differences and what they are divided by, (..., 2) for x and y, and the photocurrent (...)."""

    difference_a: Floats
    over_a: Floats
    photocurrent_a: Floats


def _opposite(current_a: Floats) -> tuple[Floats, Floats]:
    return current_a[..., 1::2] - current_a[..., 0::2], current_a[..., 0::2] + current_a[..., 1::2]


def _duo_lateral(current_a: Floats) -> _Ratios:
    """x1, x2, y1, y2, of two layers that carry the same photocurrent each: its best value is the mean of both sums."""
    difference_a, sums_a = _opposite(current_a)
    return _Ratios(difference_a, sums_a, sums_a.mean(axis=-1))


def _tetra_lateral(current_a: Floats) -> _Ratios:
    """x1, x2, y1, y2 at the four edges of one layer, which share the photocurrent."""
    difference_a, sums_a = _opposite(current_a)
    return _Ratios(difference_a, sums_a, sums_a.sum(axis=-1))


def _corners(current_a: Floats) -> _Ratios:
    """A (-x, +y), B (+x, +y), C (+x, -y), D (-x, -y): x from (B + C) - (A + D), y from (A + B) - (C + D)."""
    a, b, c, d = np.moveaxis(current_a, -1, 0)
    total_a = a + b + c + d
    difference_a = np.stack([(b + c) - (a + d), (a + b) - (c + d)], axis=-1)
    return _Ratios(difference_a, np.stack([total_a, total_a], axis=-1), total_a)


KINDS: Mapping[FaceKind, Callable[[Floats], _Ratios]] = {
    FaceKind.DUO_LATERAL: _duo_lateral,
    FaceKind.TETRA_LATERAL: _tetra_lateral,
    FaceKind.QUADRANT: _corners,
    FaceKind.PIN_CUSHION: _corners,
}
NEEDS_SPOT_RADIUS = (FaceKind.QUADRANT,)


@dataclass(frozen=True)
class Face:
    """One detector face. `length_m`: from electrode to electrode. `spot_radius_m`: at 1/e^2, for a quadrant face only.

    ValueError when a quadrant face has no spot radius: its ratio means nothing in metres without one.
    """

    kind: FaceKind
    length_m: float
    spot_radius_m: float | None = None

    def __post_init__(self) -> None:
        if self.kind in NEEDS_SPOT_RADIUS and self.spot_radius_m is None:
            raise ValueError(
                f"PSD face of kind {self.kind.name}: metres need the radius of the spot; give spot_radius_m in the rig"
            )

    def read(self, current_a: ArrayLike) -> Reading:
        """Spot of currents (..., 4) A in the order of the kind; NaN where there is no light, or no spot explains it."""
        ratios = _ratios(self.kind, current_a)
        spot_m = self._metres(_quotient(ratios.difference_a, ratios.over_a))
        return Reading(spot_m[..., 0], spot_m[..., 1], ratios.photocurrent_a)

    def mean(self, current_a: ArrayLike) -> MeanReading:
        """Spot of the averaged currents of (sample, 4) A, at least 2 samples: currents are averaged, not positions.

        Position is a ratio, so a mean of positions is biased by the noise of the sum; the ratio of means is not, to
        first order. Its sigma: s^2 = sum of (d_i - r s_i)^2 / (n (n - 1)) / mean(s)^2, d_i, s_i the difference and sum
        of sample i, r the ratio of means. Source: W. G. Cochran, Sampling Techniques, 3rd ed. 1977, section 2.11,
        without the correction for a finite population. Holds for samples that are independent of each other.
        """
        current = np.asarray(current_a, dtype=np.float64)
        if current.ndim != 2 or len(current) < 2:
            raise ValueError(f"currents of shape {current.shape}; a mean with its sigma needs (sample >= 2, 4)")
        each = _ratios(self.kind, current)
        over_a = each.over_a.mean(axis=0)
        ratio = _quotient(each.difference_a.mean(axis=0), over_a)
        residual_a = each.difference_a - ratio * each.over_a
        count = len(current)
        ratio_sigma = _quotient(np.sqrt(np.sum(residual_a**2, axis=0) / (count * (count - 1))), np.abs(over_a))
        spot_m, sigma_m = self._metres(ratio), ratio_sigma * self._slope_m(ratio)
        (x_m, y_m), (x_sigma_m, y_sigma_m) = spot_m.tolist(), sigma_m.tolist()
        return MeanReading(x_m, y_m, float(each.photocurrent_a.mean()), x_sigma_m, y_sigma_m, count)

    @property
    def metres_per_ratio(self) -> float:
        """Metres for a step of (difference / sum) at the centre."""
        return float(self._slope_m(np.zeros(1))[0])

    def _metres(self, ratio: Floats) -> Floats:
        if self.spot_radius_m is None or self.kind not in NEEDS_SPOT_RADIUS:
            return 0.5 * self.length_m * ratio
        with np.errstate(invalid="ignore"):  # beyond 1, by noise: no spot does that, NaN
            found_m = self.spot_radius_m / np.sqrt(2.0) * erfinv(ratio)
        return np.where(np.abs(ratio) < 1.0, found_m, np.nan)

    def _slope_m(self, ratio: Floats) -> Floats:
        """Metres for a step of the ratio: d/dr erfinv(r) = sqrt(pi)/2 exp(erfinv(r)^2)."""
        if self.spot_radius_m is None or self.kind not in NEEDS_SPOT_RADIUS:
            return np.full_like(ratio, 0.5 * self.length_m)
        with np.errstate(invalid="ignore", over="ignore"):
            return self.spot_radius_m / np.sqrt(2.0) * 0.5 * np.sqrt(np.pi) * np.exp(erfinv(ratio) ** 2)


def layer_mismatch(current_a: ArrayLike) -> Floats:
    """|X sum - Y sum| over their mean, of duo-lateral currents (..., 4): the layers carry the same photocurrent, so
    more than some per mille points to a bad contact or of saturation; NaN in the dark.
    """
    ratios = _duo_lateral(_four(current_a))
    return _quotient(np.abs(ratios.over_a[..., 0] - ratios.over_a[..., 1]), ratios.photocurrent_a)


def _ratios(kind: FaceKind, current_a: ArrayLike) -> _Ratios:
    return KINDS[kind](_four(current_a))


def _four(current_a: ArrayLike) -> Floats:
    current = np.asarray(current_a, dtype=np.float64)
    if current.shape[-1:] != (4,):
        raise ValueError(f"currents of shape {current.shape}; the last axis must be the four electrodes x1, x2, y1, y2")
    return current


def _quotient(numerator: Floats, denominator: Floats) -> Floats:
    lit = denominator != 0.0
    return np.divide(numerator, denominator, out=np.full(np.broadcast(numerator, denominator).shape, np.nan), where=lit)
