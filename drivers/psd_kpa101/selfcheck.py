"""What no document settles about a KPA101, measured: the signs of x and y, and the scale of the sum.

With the spot at places known but for the zero, place = b q + place0, where q = h X / (count_sum / 65535), h metres for
a step of the ratio at the centre and X in volts; then sign = sign(b) and full scale of the sum = 1 / |b|. Only the
quotient of h and the scale shows: the scale found is the one that goes with the length (or spot radius) of the rig.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drivers.psd_kpa101.messages import FULL_COUNT, FULL_SCALE_V, FULL_SUM_COUNT

Floats = NDArray[np.float64]
SURE = 10.0  # slopes by their sigma: a sign that is wrong by chance has less than 1e-23
LEAST_PLACES = 3


class CheckStatus(Enum):
    """Whether the places are enough."""

    GOOD = "good"
    TOO_FEW_PLACES = "too few places: give at least 3 with light, each axis moved"
    NOT_MOVED = "the readings do not follow the places: move the spot farther along both axes, and check the light"
    AXES_EXCHANGED = "the unit's x follows the y of the places: turn the head, or exchange the columns"


@dataclass(frozen=True)
class AxisCheck:
    """One axis of a unit."""

    sign: int
    sum_full_scale_v: float
    sigma_v: float


@dataclass(frozen=True)
class UnitCheck:
    """Both axes, None when the status has the reason; `sum_full_scale_v` is their mean by weight."""

    status: CheckStatus
    x: AxisCheck | None = None
    y: AxisCheck | None = None

    @property
    def sum_full_scale_v(self) -> tuple[float, float] | None:
        """V at 65535 counts, and one sigma."""
        if self.x is None or self.y is None:
            return None
        weight = np.array([self.x.sigma_v, self.y.sigma_v]) ** -2.0
        scales = np.array([self.x.sum_full_scale_v, self.y.sum_full_scale_v])
        return float(weight @ scales / weight.sum()), float(weight.sum() ** -0.5)


def check_unit(places_m: ArrayLike, counts: ArrayLike, metres_per_ratio: float) -> UnitCheck:
    """From places (place, 2) m and mean counts (place, 3) of x, y, sum. ValueError for shapes that do not fit."""
    places, read = np.asarray(places_m, dtype=np.float64), np.asarray(counts, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 2 or read.shape != (len(places), 3):
        raise ValueError(f"places of shape {places.shape} and counts of {read.shape}; give (place, 2) and (place, 3)")
    lit = read[:, 2] > 0.0
    if np.count_nonzero(lit) < LEAST_PLACES:
        return UnitCheck(CheckStatus.TOO_FEW_PLACES)
    places, read = places[lit], read[lit]
    q = metres_per_ratio * (read[:, :2] * FULL_SCALE_V / FULL_COUNT) / (read[:, 2:] / FULL_SUM_COUNT)
    if _follows(q[:, 0], places[:, 1]) > 2.0 * _follows(q[:, 0], places[:, 0]):
        return UnitCheck(CheckStatus.AXES_EXCHANGED)
    rounding_m = metres_per_ratio * (FULL_SCALE_V / FULL_COUNT) / (read[:, 2].mean() / FULL_SUM_COUNT) / math.sqrt(12.0)
    x, y = (_axis(q[:, k], places[:, k], rounding_m) for k in (0, 1))
    if x is None or y is None:
        return UnitCheck(CheckStatus.NOT_MOVED)
    return UnitCheck(CheckStatus.GOOD, x, y)


def _follows(one: Floats, other: Floats) -> float:
    """|correlation|; 0 for a column that stands still."""
    a, b = one - one.mean(), other - other.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return abs(float(a @ b)) / size if size > 0.0 else 0.0


def _axis(q: Floats, place_m: Floats, rounding: float) -> AxisCheck | None:
    """`rounding`: one sigma of q by the converter alone; the scatter of the places is never taken to be less."""
    a, b = q - q.mean(), place_m - place_m.mean()
    spread = float(a @ a)
    if spread == 0.0:
        return None
    slope = float(a @ b) / spread
    residual = b - slope * a
    variance = max(residual @ residual / max(len(b) - 2, 1), (slope * rounding) ** 2)
    sigma = math.sqrt(float(variance) / spread)
    if abs(slope) <= SURE * sigma or slope == 0.0:
        return None
    return AxisCheck(1 if slope > 0.0 else -1, 1.0 / abs(slope), sigma / slope**2)
